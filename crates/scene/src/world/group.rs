//! The geometry of the world, or of one instanced object: a tree over its primitives and what they refer to.

use crate::{Error, FloatTexture, Handle, Material, MediumInterface, Primitive, Scattering, Scene, Shape};
use steradian_geometry::{Accel, CurveSet, DistanceGrid, InputTriangle, PlacedQuadric, Quadric, SurfaceHit};
use steradian_math::{Bounds3, Ray, Transform};

/// What a primitive is, once built.
#[derive(Clone, Debug)]
pub(super) struct PrimitiveRecord {
    pub material: Handle<Material>,
    pub alpha: Option<Handle<FloatTexture>>,
    /// The media that it separates, if it does.
    pub media: Option<MediumInterface>,
    /// Index of its mesh, if it is one.
    pub mesh: u32,
    /// Whether that is a mesh of triangles.
    pub is_mesh: bool,
    /// The group's number of its first triangle.
    pub first_triangle: u32,
    /// The number of the light that its first element is.
    pub first_light: Option<u32>,
    /// Emission that cannot be sampled: area light and factor.
    pub unsampled_emission: Option<(u32, f32)>,
    /// Whether nothing asks for tangents of its surface.
    pub isotropic: bool,
    /// Whether something asks for the size of the sample on its surface.
    pub footprint: bool,
}

/// Something in the tree that is not a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) enum Other {
    Quadric {
        primitive: u32,
        index: u32,
    },
    Patch {
        primitive: u32,
        face: u32,
    },
    /// `set` is an index into the group's curve sets.
    Curve {
        primitive: u32,
        set: u32,
        piece: u32,
    },
    /// `grid` is an index into the group's grids of distances.
    Cell {
        primitive: u32,
        grid: u32,
        cell: u32,
    },
    Instance(u32),
}

/// Signed distances, where they are, and which side is out.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedDistances {
    grid: Handle<DistanceGrid>,
    to_world: Transform,
    flip: bool,
}

impl PlacedDistances {
    pub fn intersect(&self, scene: &Scene, cell: u32, ray: &Ray) -> Option<f32> {
        scene.distance_grids[self.grid].intersect(cell, ray, &self.to_world)
    }

    pub fn interaction(&self, scene: &Scene, cell: u32, ray: &Ray, t: f32) -> SurfaceHit {
        scene.distance_grids[self.grid].interaction(cell, ray, t, &self.to_world, self.flip)
    }
}

#[derive(Clone, Debug)]
pub(super) struct Group {
    pub accel: Accel,
    pub primitives: Vec<PrimitiveRecord>,
    /// The primitive of each triangle.
    pub primitive_of_triangle: Vec<u32>,
    pub others: Vec<Other>,
    pub quadrics: Vec<PlacedQuadric>,
    pub curves: Vec<CurveSet>,
    pub distances: Vec<PlacedDistances>,
}

/// How often each mesh is used, triangles and bilinear ones.
pub(super) struct MeshUses {
    triangles: Vec<u32>,
    bilinear: Vec<u32>,
}

impl MeshUses {
    pub fn count<'a>(scene: &Scene, primitives: impl Iterator<Item = &'a Primitive>) -> Self {
        let mut uses =
            Self { triangles: vec![0; scene.triangle_meshes.len()], bilinear: vec![0; scene.bilinear_meshes.len()] };
        for p in primitives {
            match &p.shape {
                Shape::Triangles(h) => uses.triangles[h.index()] += 1,
                Shape::Bilinear(h) => uses.bilinear[h.index()] += 1,
                Shape::Sphere(_) | Shape::Disk(_) | Shape::Cylinder(_) | Shape::Curves(_) | Shape::Distances(_) => {}
            }
        }
        uses
    }
}

/// Moves the meshes of `primitives` to the space of their group, so that nothing needs a transform afterwards. A mesh
/// with one user is moved in place; others are copied for each user that moves them.
pub(super) fn place_meshes(scene: &mut Scene, primitives: &mut [Primitive], uses: &MeshUses) -> Result<(), Error> {
    for p in primitives {
        let t = std::mem::take(&mut p.world_from_object);
        let reverse = std::mem::take(&mut p.reverse_orientation);
        let stays = t.is_identity() && !reverse;
        match &mut p.shape {
            Shape::Triangles(handle) => {
                let mesh = &scene.triangle_meshes[*handle];
                mesh.validate().map_err(|source| Error::Mesh { mesh: handle.index(), source })?;
                if !stays {
                    let placed = mesh.transformed(&t, reverse);
                    if uses.triangles[handle.index()] == 1 {
                        scene.triangle_meshes[*handle] = placed;
                    } else {
                        *handle = scene.triangle_meshes.push(placed);
                    }
                }
            }
            Shape::Bilinear(handle) => {
                let mesh = &scene.bilinear_meshes[*handle];
                mesh.validate().map_err(|source| Error::Mesh { mesh: handle.index(), source })?;
                if !stays {
                    let placed = mesh.transformed(&t, reverse);
                    if uses.bilinear[handle.index()] == 1 {
                        scene.bilinear_meshes[*handle] = placed;
                    } else {
                        *handle = scene.bilinear_meshes.push(placed);
                    }
                }
            }
            // The others keep their transform: they are intersected in their own space.
            Shape::Sphere(_) | Shape::Disk(_) | Shape::Cylinder(_) | Shape::Curves(_) | Shape::Distances(_) => {
                p.world_from_object = t;
                p.reverse_orientation = reverse;
            }
        }
    }
    Ok(())
}

/// Whether rays pass through a primitive as if it were not there: nothing to scatter, to emit, or to bound a medium that
/// the integrator sees.
fn is_invisible(scene: &Scene, p: &Primitive) -> bool {
    matches!(scene.materials[p.material].scattering, Scattering::Interface)
        && (p.media.is_none() || !scene.settings.integrator.kind.sees_media())
        && p.area_light.is_none()
}

impl Group {
    /// Builds the tree over primitives already in place, and instances by their bounds.
    pub fn build(scene: &Scene, primitives: &[Primitive], instances: &[(u32, Bounds3)]) -> Result<Self, Error> {
        let mut records = Vec::with_capacity(primitives.len());
        let mut primitive_of_triangle = Vec::new();
        let (mut others, mut bounds) = (Vec::new(), Vec::new());
        let (mut quadrics, mut curves, mut distances) = (Vec::new(), Vec::new(), Vec::new());
        for (i, p) in primitives.iter().enumerate() {
            let i = i as u32;
            let mut record = PrimitiveRecord {
                material: p.material,
                alpha: p.alpha,
                media: p.media,
                mesh: 0,
                is_mesh: matches!(p.shape, Shape::Triangles(_)),
                first_triangle: primitive_of_triangle.len() as u32,
                first_light: None,
                unsampled_emission: None,
                isotropic: false,
                footprint: false,
            };
            let shown = !is_invisible(scene, p);
            let mut quadric = |q: Quadric| {
                let placed = PlacedQuadric::new(q, p.world_from_object, p.reverse_orientation);
                if shown {
                    others.push(Other::Quadric { primitive: i, index: quadrics.len() as u32 });
                    bounds.push(placed.bounds());
                }
                quadrics.push(placed);
            };
            match &p.shape {
                Shape::Sphere(s) => quadric(Quadric::Sphere(*s)),
                Shape::Disk(d) => quadric(Quadric::Disk(*d)),
                Shape::Cylinder(c) => quadric(Quadric::Cylinder(*c)),
                Shape::Curves(c) => {
                    let placed = CurveSet::new(c.clone(), &p.world_from_object, p.reverse_orientation);
                    if shown {
                        for piece in 0..placed.len() as u32 {
                            others.push(Other::Curve { primitive: i, set: curves.len() as u32, piece });
                            bounds.push(placed.bounds(piece));
                        }
                    }
                    curves.push(placed);
                }
                Shape::Distances(grid) => {
                    let (grid, to_world) = (*grid, p.world_from_object);
                    if shown {
                        for cell in scene.distance_grids[grid].cells() {
                            others.push(Other::Cell { primitive: i, grid: distances.len() as u32, cell });
                            bounds.push(to_world.bounds(&scene.distance_grids[grid].bounds(cell)));
                        }
                    }
                    let flip = p.reverse_orientation ^ to_world.swaps_handedness();
                    distances.push(PlacedDistances { grid, to_world, flip });
                }
                Shape::Triangles(handle) => {
                    record.mesh = handle.index() as u32;
                    let mesh = &scene.triangle_meshes[*handle];
                    if shown {
                        primitive_of_triangle.resize(primitive_of_triangle.len() + mesh.indices.len(), i);
                    }
                }
                Shape::Bilinear(handle) => {
                    record.mesh = handle.index() as u32;
                    let mesh = &scene.bilinear_meshes[*handle];
                    if shown {
                        for face in 0..mesh.indices.len() {
                            others.push(Other::Patch { primitive: i, face: face as u32 });
                            bounds.push(mesh.patch(face).bounds());
                        }
                    }
                }
            }
            records.push(record);
        }
        for (index, b) in instances {
            if !b.is_empty() {
                others.push(Other::Instance(*index));
                bounds.push(*b);
            }
        }
        let triangle = |i: usize| {
            let p: &PrimitiveRecord = &records[primitive_of_triangle[i] as usize];
            let mesh = &scene.triangle_meshes.as_slice()[p.mesh as usize];
            InputTriangle {
                p: mesh.triangle(i - p.first_triangle as usize).p,
                id: i as u32,
                filtered: p.alpha.is_some(),
            }
        };
        let accel = Accel::build_from(primitive_of_triangle.len(), triangle, &bounds)?;
        Ok(Self { accel, primitives: records, primitive_of_triangle, others, quadrics, curves, distances })
    }

    /// Bytes of the tree and the tables, not of the meshes.
    pub fn byte_size(&self) -> usize {
        self.accel.byte_size()
            + size_of_val(self.primitives.as_slice())
            + size_of_val(self.primitive_of_triangle.as_slice())
            + size_of_val(self.others.as_slice())
            + size_of_val(self.quadrics.as_slice())
            + self.curves.iter().map(CurveSet::byte_size).sum::<usize>()
    }
}
