//! What an integrator tells about a path while it traces it: counters, the path itself. Costs nothing when off.

use steradian_math::{Normal3, Point3, Vec3};
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
    /// A ray is about to be traced.
    #[inline]
    fn ray(&mut self, _kind: RayKind) {}
    /// The path arrived at a surface.
    #[inline]
    fn vertex(&mut self, _vertex: Vertex) {}
    /// Light was found.
    #[inline]
    fn contribution(&mut self, _c: Contribution) {}
    /// The path goes on.
    #[inline]
    fn bounce(&mut self, _b: Bounce) {}
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
