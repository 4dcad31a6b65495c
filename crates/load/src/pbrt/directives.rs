//! What each directive does to the state, or which part of the loader it goes to.

use super::media::placeholder;
use super::names::defined_twice;
use super::params::{Inherited, Params};
use super::state::{LIGHT, MATERIAL, MEDIUM, SHAPE, TARGETS, TEXTURE};
use super::{Block, Loader, MOST_BLOCKS};
use std::rc::Rc;
use steradian_math::{Point3, Transform, Vec3};
use steradian_scene::{Instance, Object};
use steradian_spectrum::ColorSpace;
use steradian_syntax::{Diagnostic, Directive, Kind, Span, did_you_mean};

impl Loader<'_> {
    pub(super) fn directive(&mut self, mut d: Directive) {
        if !self.in_place(&d) {
            return;
        }
        match d.kind {
            Kind::Identity
            | Kind::Translate
            | Kind::Scale
            | Kind::Rotate
            | Kind::LookAt
            | Kind::Transform
            | Kind::ConcatTransform
            | Kind::CoordinateSystem
            | Kind::CoordSysTransform
            | Kind::ActiveTransform
            | Kind::TransformTimes => self.transform_directive(&d),
            Kind::AttributeBegin => self.begin(Block::Attribute, d.span),
            Kind::TransformBegin => {
                self.warning_once(
                    "`TransformBegin` is deprecated and saves all attributes; write `AttributeBegin`",
                    d.span,
                );
                self.begin(Block::Transform, d.span);
            }
            Kind::AttributeEnd => self.end(Block::Attribute, d.span),
            Kind::TransformEnd => self.end(Block::Transform, d.span),
            Kind::ObjectBegin => self.object_begin(&d),
            Kind::ObjectEnd => self.end(Block::Object, d.span),
            Kind::ObjectInstance => self.object_instance(&d),
            Kind::Attribute => self.attribute(&mut d),
            Kind::ReverseOrientation => self.state.reverse_orientation = !self.state.reverse_orientation,
            Kind::ColorSpace => self.color_space(&d),
            Kind::MediumInterface => self.medium_interface(&d),
            Kind::NamedMaterial => self.named_material(&d),
            Kind::Include => self.include(&d, false),
            Kind::Import => self.include(&d, true),
            Kind::Option => self.option(&d),
            Kind::WorldBegin => self.world_begin(&d),
            Kind::WorldEnd if self.is_v3 => {}
            Kind::WorldEnd => {
                self.warning("`WorldEnd` is not part of pbrt-v4 and does nothing", d.span);
            }
            Kind::Accelerator | Kind::Camera | Kind::Film | Kind::Integrator | Kind::PixelFilter | Kind::Sampler => {
                self.declare(d);
            }
            Kind::AreaLightSource => self.area_light_source(d),
            Kind::LightSource => self.light_source(d),
            Kind::Material => self.material(d),
            Kind::MakeNamedMaterial => self.make_named_material(d),
            Kind::MakeNamedMedium => self.make_named_medium(d),
            Kind::Texture => self.texture(d),
            Kind::Shape => self.shape(d),
        }
    }

    /// Whether the directive may stand on this side of `WorldBegin`; reports it if not.
    fn in_place(&mut self, d: &Directive) -> bool {
        let name = d.kind.name();
        match (d.kind, self.world) {
            (
                Kind::Accelerator
                | Kind::Camera
                | Kind::Film
                | Kind::Integrator
                | Kind::PixelFilter
                | Kind::Sampler
                | Kind::TransformTimes
                | Kind::WorldBegin,
                Some(world),
            ) => {
                let d = Diagnostic::error(format!("`{name}` must come before `WorldBegin`"), d.span);
                self.diagnostics.push(d.with_related("`WorldBegin` is here", world));
                false
            }
            (
                Kind::AreaLightSource
                | Kind::AttributeBegin
                | Kind::AttributeEnd
                | Kind::Import
                | Kind::LightSource
                | Kind::MakeNamedMaterial
                | Kind::Material
                | Kind::NamedMaterial
                | Kind::ObjectBegin
                | Kind::ObjectEnd
                | Kind::ObjectInstance
                | Kind::ReverseOrientation
                | Kind::Shape
                | Kind::Texture
                | Kind::TransformBegin
                | Kind::TransformEnd
                | Kind::WorldEnd,
                None,
            ) => {
                self.error(format!("`{name}` must come after `WorldBegin`"), d.span);
                false
            }
            _ => true,
        }
    }

    fn transform_directive(&mut self, d: &Directive) {
        let matrix = match d.kind {
            Kind::Identity => {
                self.state.set(&[Transform::IDENTITY; 2]);
                return;
            }
            Kind::CoordinateSystem => {
                self.coordinate_systems.insert(d.text(0).to_string(), self.state.ctm);
                return;
            }
            Kind::CoordSysTransform => {
                match self.coordinate_systems.get(d.text(0)) {
                    Some(t) => self.state.set(&t.clone()),
                    None => {
                        let message =
                            format!("there is no coordinate system \"{}\"; the directive does nothing", d.text(0));
                        let near = did_you_mean(d.text(0), self.coordinate_systems.keys().map(String::as_str));
                        let w = Diagnostic::warning(message, d.arg_span(0)).with_suggestion(near);
                        self.diagnostics.push(w);
                    }
                }
                return;
            }
            Kind::ActiveTransform => {
                match d.text(0) {
                    "All" => self.state.active = [true; 2],
                    "StartTime" => self.state.active = [true, false],
                    "EndTime" => self.state.active = [false, true],
                    other => {
                        let e = Diagnostic::error(format!("`ActiveTransform` cannot be `{other}`"), d.arg_span(0));
                        self.diagnostics.push(e.with_hint("it can be All, StartTime or EndTime"));
                    }
                }
                return;
            }
            Kind::TransformTimes => {
                if let Some([start, end]) = d.numbers() {
                    if start < end {
                        self.state.times = [start, end];
                    } else {
                        self.error(
                            "`TransformTimes` must have its start before its end",
                            d.arg_span(0).to(d.arg_span(1)),
                        );
                    }
                }
                return;
            }
            Kind::Translate => d.numbers().map(|[x, y, z]| Transform::translate(Vec3::new(x, y, z))),
            Kind::Scale => d.numbers().and_then(|[x, y, z]| Transform::scale(x, y, z)),
            Kind::Rotate => d.numbers().and_then(|[angle, x, y, z]| Transform::rotate(angle, Vec3::new(x, y, z))),
            Kind::LookAt => d.numbers().and_then(|[ex, ey, ez, lx, ly, lz, ux, uy, uz]| {
                Transform::look_at(Point3::new(ex, ey, ez), Point3::new(lx, ly, lz), Vec3::new(ux, uy, uz))
            }),
            _ => d.numbers().and_then(|m| Transform::from_column_major(&m)),
        };
        let last = d.args.len().saturating_sub(1);
        let span = d.arg_span(0).to(d.arg_span(last));
        let Some(matrix) = matrix else {
            let what = match d.kind {
                Kind::Scale => "`Scale` by zero cannot be undone",
                Kind::Rotate => "`Rotate` needs an axis that is not zero",
                Kind::LookAt => {
                    "`LookAt` needs two different points and an up vector that is not parallel to their connection"
                }
                _ => "this matrix has no inverse",
            };
            self.error(what, span);
            return;
        };
        if d.kind == Kind::Transform {
            self.state.set(&[matrix; 2]);
        } else {
            self.state.concat(&matrix);
        }
        if self.state.ctm.iter().any(|t| t.m.iter().chain(&t.inv).flatten().any(|v| !v.is_finite())) {
            self.error("the transforms multiply to numbers that are too large", span);
            self.state.ctm = [Transform::IDENTITY; 2];
        }
    }

    fn begin(&mut self, block: Block, span: Span) {
        if self.blocks.len() == MOST_BLOCKS && self.said.insert("blocks".into()) {
            self.error(format!("blocks nest more than {MOST_BLOCKS} deep"), span);
        }
        if self.blocks.len() >= MOST_BLOCKS {
            return;
        }
        self.blocks.push((block, span, self.state.clone()));
    }

    fn end(&mut self, block: Block, span: Span) {
        let name = block.name();
        match self.blocks.last() {
            Some((open, _, _)) if *open == block => {
                if let Some((_, _, state)) = self.blocks.pop() {
                    self.state = state;
                }
                if block == Block::Object {
                    self.object = None;
                }
            }
            Some((open, begin, _)) => {
                let (open, begin) = (open.name(), *begin);
                let d = Diagnostic::error(format!("`{name}End` closes `{open}Begin`"), span);
                self.diagnostics.push(d.with_related(format!("`{open}Begin` is here"), begin));
            }
            None => self.error(format!("`{name}End` without `{name}Begin`"), span),
        }
    }

    fn object_begin(&mut self, d: &Directive) {
        let (name, span) = (d.text(0), d.arg_span(0));
        if self.object.is_some() {
            self.error("objects cannot be defined inside objects", d.span);
        }
        let placeholder = || Object { name: name.to_string(), ..Object::default() };
        match self.objects.defined(name, span, &mut self.scene.objects, placeholder) {
            Ok(handle) => self.object = Some(handle),
            Err(first) => self.diagnostics.push(defined_twice("object", name, span, first)),
        }
        // Even a wrong beginning opens a block, so that its end is not reported as well.
        self.begin(Block::Object, d.span);
    }

    fn object_instance(&mut self, d: &Directive) {
        let name = d.text(0);
        let placeholder = || Object { name: name.to_string(), ..Object::default() };
        let object = self.objects.used(name, d.arg_span(0), &mut self.scene.objects, placeholder);
        let instance = Instance { object, world_from_object: self.state.animated() };
        let Some(outer) = self.object else {
            self.scene.instances.push(instance);
            return;
        };
        // pbrt has no nested instances; what they would mean is plain.
        if outer == object {
            self.error(format!("the object \"{name}\" contains itself"), d.arg_span(0));
            return;
        }
        self.scene.objects[outer].instances.push(instance);
    }

    fn attribute(&mut self, d: &mut Directive) {
        let target = d.text(0).to_string();
        let Some(i) = TARGETS.iter().position(|t| *t == target) else {
            let near = did_you_mean(&target, TARGETS);
            let e = Diagnostic::error(format!("`Attribute` cannot be for \"{target}\""), d.arg_span(0));
            self.diagnostics.push(match near {
                Some(_) => e.with_suggestion(near),
                None => e.with_hint(format!("it can be for {}", TARGETS.join(", "))),
            });
            return;
        };
        let list = Rc::make_mut(&mut self.state.inherited[i]);
        let color_space = self.state.color_space;
        list.extend(d.params.drain(..).map(|param| Inherited { param, color_space }));
    }

    /// The parameters of a directive, with what it inherits.
    pub(super) fn params(&self, d: &mut Directive) -> Params {
        let inherited = match d.kind {
            Kind::Shape => &self.state.inherited[SHAPE],
            Kind::LightSource | Kind::AreaLightSource => &self.state.inherited[LIGHT],
            Kind::Material | Kind::MakeNamedMaterial => &self.state.inherited[MATERIAL],
            Kind::MakeNamedMedium => &self.state.inherited[MEDIUM],
            Kind::Texture => &self.state.inherited[TEXTURE],
            _ => &Rc::default(),
        };
        Params::new(d, inherited, self.state.color_space)
    }

    fn color_space(&mut self, d: &Directive) {
        match ColorSpace::from_name(d.text(0)) {
            Some(space) => self.state.color_space = space,
            None => {
                let names = ColorSpace::ALL.map(ColorSpace::name);
                let e = Diagnostic::error(format!("unknown color space \"{}\"", d.text(0)), d.arg_span(0));
                self.diagnostics.push(match did_you_mean(d.text(0), names) {
                    Some(near) => e.with_suggestion(Some(near)),
                    None => e.with_hint(format!("it can be {}", names.join(", "))),
                });
            }
        }
    }

    fn medium_interface(&mut self, d: &Directive) {
        let mut side = |i: usize| {
            let name = d.text(i);
            let media = &mut self.scene.media;
            (!name.is_empty()).then(|| self.media.used(name, d.arg_span(i), media, || placeholder(name)))
        };
        let inside = side(0);
        let outside = if d.args.len() > 1 { side(1) } else { inside };
        if inside.or(outside).is_some() {
            self.media_span.get_or_insert(d.span);
        }
        (self.state.inside, self.state.outside) = (inside, outside);
    }

    fn world_begin(&mut self, d: &Directive) {
        self.world = Some(d.span);
        self.state.ctm = [Transform::IDENTITY; 2];
        self.state.active = [true; 2];
        self.coordinate_systems.insert("world".into(), self.state.ctm);
    }
}
