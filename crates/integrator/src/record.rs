//! What an integrator tells about a path while it traces it: counters, the path itself. Costs nothing when off.

use steradian_bsdf::Bsdf;
use steradian_geometry::{RayRows, TestCounts};
use steradian_math::{Frame, Normal3, Point3, Ray, Vec3};
use steradian_scene::{Hit, Surface, World};
use steradian_spectrum::Lanes;

/// What a ray is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// From the camera.
    Camera,
    /// Sampled from a lobe.
    Scattered,
    /// Towards a sampled light.
    Shadow,
}

/// What happened at a vertex of the path.
#[derive(Clone, Debug)]
pub struct Vertex {
    /// Number of bounces before it.
    pub depth: u32,
    /// Position.
    pub p: Point3,
    /// Shading normal.
    pub n: Normal3,
    /// Name of the material.
    pub material: String,
    /// Name of the lobe.
    pub lobe: String,
    /// Throughput on arrival.
    pub throughput: Lanes,
}

impl Vertex {
    /// A point of a surface with its shading frame and what scatters there.
    pub fn on(world: &World, depth: u32, (surface, frame): (&Surface, &Frame), bsdf: &Bsdf, throughput: Lanes) -> Self {
        Self {
            depth,
            p: surface.p,
            n: frame.normal(),
            material: world.material_name(surface),
            lobe: bsdf.name().to_owned(),
            throughput,
        }
    }
}

/// How light was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Technique {
    /// The path ran into a light.
    Hit,
    /// A point on a light was sampled.
    LightSampling,
}

/// One contribution of light to the path.
#[derive(Clone, Copy, Debug)]
pub struct Contribution {
    /// Number of bounces.
    pub depth: u32,
    /// How it was found.
    pub technique: Technique,
    /// Which light, if it has a number.
    pub light: Option<u32>,
    /// Direction towards the light.
    pub direction: Vec3,
    /// Where the light was met, unless infinitely far.
    pub end: Option<Point3>,
    /// Density of the technique, per solid angle; zero for Dirac lights and lobes.
    pub pdf: f32,
    /// Density of the other technique.
    pub other_pdf: f32,
    /// Weight of multiple importance sampling.
    pub weight: f32,
    /// What was added to the radiance, before any shadow.
    pub value: Lanes,
    /// Whether something stood in the way.
    pub occluded: bool,
}

impl Contribution {
    /// Light that was run into, and that nobody looks for in any other way.
    pub(crate) fn only_way(depth: u32, light: Option<u32>, direction: Vec3, end: Option<Point3>, value: Lanes) -> Self {
        let technique = Technique::Hit;
        Self { depth, technique, light, direction, end, pdf: 0.0, other_pdf: 0.0, weight: 1.0, value, occluded: false }
    }
}

/// One sampled continuation of the path.
#[derive(Clone, Copy, Debug)]
pub struct Bounce {
    /// Sampled direction.
    pub direction: Vec3,
    /// Its density per solid angle, or probability if specular.
    pub pdf: f32,
    /// `f cos / pdf`.
    pub weight: Lanes,
    /// Whether the lobe was a Dirac one.
    pub specular: bool,
    /// Whether it crossed the surface.
    pub transmission: bool,
    /// The probability with which Russian roulette let the path live.
    pub survival: f32,
}

/// Receives what happens along a path. Every method does nothing unless overridden.
pub trait Record {
    /// Whether vertices and contributions are wanted at all: lets callers skip preparing them.
    const DETAILED: bool = false;
    /// Whether contributions alone are wanted: they are cheap to tell.
    const LIGHT: bool = Self::DETAILED;
    /// Whether intersection tests are to be counted.
    const TESTS: bool = false;
    /// A ray is about to be traced.
    #[inline]
    fn ray(&mut self, _kind: RayKind) {}
    /// The path arrived at a surface.
    #[inline]
    fn vertex(&mut self, _vertex: Vertex) {}
    /// Light was found.
    #[inline]
    fn contribution(&mut self, _c: Contribution) {}
    /// Everything that this sample finds counts so much in its pixel: what a lens lets through. Told before the first contribution,
    /// unless it is one.
    #[inline]
    fn weight(&mut self, _weight: f32) {}
    /// The path goes on.
    #[inline]
    fn bounce(&mut self, _b: Bounce) {}
    /// A ray took so many tests of boxes and of primitives.
    #[inline]
    fn tests(&mut self, _boxes: u64, _primitives: u64) {}
    /// A path ended after so many bounces, the one at which it was absorbed included.
    #[inline]
    fn path(&mut self, _bounces: u32) {}
}

/// [`World::intersect`], with its tests counted if the record wants that.
#[inline]
pub(crate) fn intersect<R: Record>(world: &World, ray: &Ray, record: &mut R) -> Option<Hit> {
    if !R::TESTS {
        return world.intersect(ray);
    }
    let counts = TestCounts::default();
    let hit = world.intersect_counted(ray, &counts);
    record.tests(counts.boxes(), counts.primitives());
    hit
}

/// [`World::occluded`], with its tests counted if the record wants that.
#[inline]
pub(crate) fn occluded<R: Record>(world: &World, ray: &Ray, record: &mut R) -> bool {
    if !R::TESTS {
        return world.occluded(ray);
    }
    let counts = TestCounts::default();
    let found = world.occluded_counted(ray, &counts);
    record.tests(counts.boxes(), counts.primitives());
    found
}

/// [`intersect`] for all rays of a row; appends the answers to `hits`.
#[inline]
pub(crate) fn intersect_rows<R: Record>(
    world: &World,
    rays: &mut RayRows,
    hits: &mut Vec<Option<Hit>>,
    record: &mut R,
) {
    if R::TESTS {
        hits.extend((0..rays.len()).map(|i| intersect(world, &rays.ray(i), record)));
    } else {
        rays.prepare(world.level());
        world.intersect_rows(rays, hits);
    }
}

/// [`occluded`] for all rays of a row: bit `i` answers ray `i`.
#[inline]
pub(crate) fn occluded_rows<R: Record>(world: &World, rays: &mut RayRows, record: &mut R) -> u64 {
    if R::TESTS {
        return (0..rays.len()).fold(0, |bits, i| bits | u64::from(occluded(world, &rays.ray(i), record)) << i);
    }
    rays.prepare(world.level());
    world.occluded_rows(rays)
}

/// Nothing is recorded.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoRecord;

impl Record for NoRecord {}

/// Numbers of rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Camera rays.
    pub camera: u64,
    /// Rays sampled from lobes.
    pub scattered: u64,
    /// Shadow rays.
    pub shadow: u64,
}

impl RayCounts {
    /// All rays.
    pub fn total(&self) -> u64 {
        self.camera + self.scattered + self.shadow
    }

    /// Adds the counts of another thread.
    pub fn merge(&mut self, o: &RayCounts) {
        self.camera += o.camera;
        self.scattered += o.scattered;
        self.shadow += o.shadow;
    }
}

impl Record for RayCounts {
    #[inline]
    fn ray(&mut self, kind: RayKind) {
        match kind {
            RayKind::Camera => self.camera += 1,
            RayKind::Scattered => self.scattered += 1,
            RayKind::Shadow => self.shadow += 1,
        }
    }
}

/// What a render is counted in: rays alone, or all of [`Counters`].
pub trait Count: Record + Clone + Default + Send + Sync {
    /// Adds the counts of another thread.
    fn merge(&mut self, o: &Self);
    /// The rays.
    fn rays(&self) -> RayCounts;
}

impl Count for RayCounts {
    fn merge(&mut self, o: &Self) {
        Self::merge(self, o);
    }
    fn rays(&self) -> RayCounts {
        *self
    }
}

/// Path lengths from here on are counted together.
pub const LONGEST_COUNTED: usize = 64;

/// All counters: what a picture costs, in units that do not depend on the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counters {
    /// Rays by kind.
    pub rays: RayCounts,
    /// Boxes tested.
    pub box_tests: u64,
    /// Triangles, other shapes and instances tested.
    pub primitive_tests: u64,
    /// How many paths ended after 0, 1, 2, ... bounces; the last entry holds all longer ones. Path tracing only.
    pub path_lengths: [u64; LONGEST_COUNTED + 1],
}

impl Default for Counters {
    fn default() -> Self {
        Self { rays: RayCounts::default(), box_tests: 0, primitive_tests: 0, path_lengths: [0; LONGEST_COUNTED + 1] }
    }
}

impl Counters {
    /// The mean number of bounces of a path; zero if there is none.
    pub fn mean_path_length(&self) -> f64 {
        let paths: u64 = self.path_lengths.iter().sum();
        let bounces: u64 = self.path_lengths.iter().zip(0..).map(|(n, length)| n * length).sum();
        if paths == 0 { 0.0 } else { bounces as f64 / paths as f64 }
    }
}

impl Record for Counters {
    const TESTS: bool = true;
    #[inline]
    fn ray(&mut self, kind: RayKind) {
        self.rays.ray(kind);
    }
    #[inline]
    fn tests(&mut self, boxes: u64, primitives: u64) {
        self.box_tests += boxes;
        self.primitive_tests += primitives;
    }
    #[inline]
    fn path(&mut self, bounces: u32) {
        self.path_lengths[(bounces as usize).min(LONGEST_COUNTED)] += 1;
    }
}

impl Count for Counters {
    fn merge(&mut self, o: &Self) {
        self.rays.merge(&o.rays);
        self.box_tests += o.box_tests;
        self.primitive_tests += o.primitive_tests;
        for (a, b) in self.path_lengths.iter_mut().zip(o.path_lengths) {
            *a += b;
        }
    }
    fn rays(&self) -> RayCounts {
        self.rays
    }
}

/// An event of a recorded path, in the order of happening.
#[derive(Clone, Debug)]
pub enum Event {
    /// A ray was traced.
    Ray(RayKind),
    /// Arrival at a surface.
    Vertex(Vertex),
    /// Light was found.
    Contribution(Contribution),
    /// A new direction.
    Bounce(Bounce),
}

/// Everything that happened along one path.
#[derive(Clone, Debug, Default)]
pub struct PathRecord {
    /// The events in order.
    pub events: Vec<Event>,
}

impl Record for PathRecord {
    const DETAILED: bool = true;
    fn ray(&mut self, kind: RayKind) {
        self.events.push(Event::Ray(kind));
    }
    fn vertex(&mut self, vertex: Vertex) {
        self.events.push(Event::Vertex(vertex));
    }
    fn contribution(&mut self, c: Contribution) {
        self.events.push(Event::Contribution(c));
    }
    fn bounce(&mut self, b: Bounce) {
        self.events.push(Event::Bounce(b));
    }
}
