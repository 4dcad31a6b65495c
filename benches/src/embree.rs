//! Embree 4, opened while the program runs, as the bar that ray queries are measured against. Nothing links to it.
#![allow(unsafe_code)]

use std::ffi::{CString, c_char, c_int, c_void};
use std::path::Path;
use std::sync::atomic::{AtomicIsize, Ordering};

use libloading::Library;
use steradian_math::Ray;

use crate::room::Corners;

type Handle = *mut c_void;

const TRIANGLES: c_int = 0;
const BUFFER_INDEX: c_int = 0;
const BUFFER_VERTEX: c_int = 1;
const UINT3: c_int = 0x5003;
const FLOAT3: c_int = 0x9003;
const INVALID: u32 = u32::MAX;

/// How Embree is asked to build: its own words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quality {
    /// 0 low (Morton codes), 1 medium (binned surface-area heuristic), 2 high (with spatial splits).
    pub build: c_int,
    /// Watertight intersection, as ours always is.
    pub robust: bool,
}

/// `RTCRayHit`, with room to spare for versions that append to it.
#[repr(C, align(16))]
struct RayHit {
    org: [f32; 3],
    tnear: f32,
    dir: [f32; 3],
    time: f32,
    tfar: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    uv: [f32; 2],
    prim_id: u32,
    geom_id: u32,
    instance: [u32; 25],
}

impl RayHit {
    fn new(ray: &Ray) -> Self {
        Self {
            org: [ray.o.x, ray.o.y, ray.o.z],
            tnear: 0.0,
            dir: [ray.d.x, ray.d.y, ray.d.z],
            time: 0.0,
            tfar: ray.t_max,
            mask: INVALID,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            uv: [0.0; 2],
            prim_id: INVALID,
            geom_id: INVALID,
            instance: [INVALID; 25],
        }
    }
}

type Query = unsafe extern "C" fn(Handle, *mut RayHit, *const c_void);

/// A scene of triangles in Embree. Never closed: its thread library does not survive that.
pub struct Embree {
    scene: Handle,
    intersect: Query,
    occluded: Query,
    bytes: &'static AtomicIsize,
    /// Seconds that the commit took.
    pub build_seconds: f64,
}

unsafe extern "C" fn count_bytes(counter: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: `counter` is the leaked counter that `Embree::build` registers together with this function.
    unsafe { &*counter.cast::<AtomicIsize>() }.fetch_add(bytes, Ordering::Relaxed);
    true
}

/// A function of the library by its name.
unsafe fn function<F: Copy>(library: &Library, name: &str) -> Result<F, String> {
    // SAFETY: the caller names the type that the public header gives the function.
    unsafe { library.get::<F>(name.as_bytes()) }.map(|f| *f).map_err(|e| e.to_string())
}

impl Embree {
    /// Builds a scene; `config` is a device configuration such as `threads=1,isa=avx2`.
    ///
    /// # Errors
    /// If the library cannot be opened, lacks a function of version 4, or says that something went wrong.
    pub fn build(library: &Path, config: &str, quality: Quality, triangles: &[Corners]) -> Result<Self, String> {
        let config = CString::new(config).map_err(|e| e.to_string())?;
        // SAFETY: every signature below is that of Embree 4's public C header; handles go only to the functions of the
        // library that made them, buffers are filled within the size asked for, and nothing is released or unloaded.
        unsafe {
            let library: &'static Library = Box::leak(Box::new(Library::new(library).map_err(|e| e.to_string())?));
            let new_device: unsafe extern "C" fn(*const c_char) -> Handle = function(library, "rtcNewDevice")?;
            let error: unsafe extern "C" fn(Handle) -> c_int = function(library, "rtcGetDeviceError")?;
            let monitor: unsafe extern "C" fn(
                Handle,
                unsafe extern "C" fn(*mut c_void, isize, bool) -> bool,
                *mut c_void,
            ) = function(library, "rtcSetDeviceMemoryMonitorFunction")?;
            let new_scene: unsafe extern "C" fn(Handle) -> Handle = function(library, "rtcNewScene")?;
            let set_quality: unsafe extern "C" fn(Handle, c_int) = function(library, "rtcSetSceneBuildQuality")?;
            let set_flags: unsafe extern "C" fn(Handle, c_int) = function(library, "rtcSetSceneFlags")?;
            let new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle = function(library, "rtcNewGeometry")?;
            let new_buffer: unsafe extern "C" fn(Handle, c_int, u32, c_int, usize, usize) -> *mut c_void =
                function(library, "rtcSetNewGeometryBuffer")?;
            let geometry_quality: unsafe extern "C" fn(Handle, c_int) =
                function(library, "rtcSetGeometryBuildQuality")?;
            let commit_geometry: unsafe extern "C" fn(Handle) = function(library, "rtcCommitGeometry")?;
            let attach: unsafe extern "C" fn(Handle, Handle) -> u32 = function(library, "rtcAttachGeometry")?;
            let commit_scene: unsafe extern "C" fn(Handle) = function(library, "rtcCommitScene")?;

            let device = new_device(config.as_ptr());
            if device.is_null() {
                return Err("Embree gave no device".into());
            }
            let bytes: &'static AtomicIsize = Box::leak(Box::new(AtomicIsize::new(0)));
            monitor(device, count_bytes, std::ptr::from_ref(bytes).cast_mut().cast());
            let scene = new_scene(device);
            set_quality(scene, quality.build);
            set_flags(scene, if quality.robust { 1 << 2 } else { 0 });
            let geometry = new_geometry(device, TRIANGLES);
            geometry_quality(geometry, quality.build);
            let vertices = new_buffer(geometry, BUFFER_VERTEX, 0, FLOAT3, 12, 3 * triangles.len()).cast::<[f32; 3]>();
            let indices = new_buffer(geometry, BUFFER_INDEX, 0, UINT3, 12, triangles.len()).cast::<[u32; 3]>();
            if vertices.is_null() || indices.is_null() {
                return Err("Embree gave no buffers".into());
            }
            for (i, t) in triangles.iter().enumerate() {
                for (k, p) in t.iter().enumerate() {
                    vertices.add(3 * i + k).write([p.x, p.y, p.z]);
                }
                indices.add(i).write([0, 1, 2].map(|k| 3 * i as u32 + k));
            }
            commit_geometry(geometry);
            attach(scene, geometry);
            let before = bytes.load(Ordering::Relaxed);
            let start = std::time::Instant::now();
            commit_scene(scene);
            let build_seconds = start.elapsed().as_secs_f64();
            bytes.fetch_sub(before, Ordering::Relaxed);
            match error(device) {
                0 => Ok(Self {
                    scene,
                    intersect: function(library, "rtcIntersect1")?,
                    occluded: function(library, "rtcOccluded1")?,
                    bytes,
                    build_seconds,
                }),
                code => Err(format!("Embree's error {code}")),
            }
        }
    }

    /// The bytes that the tree holds, without the vertices and indices that were handed over.
    pub fn tree_bytes(&self) -> usize {
        self.bytes.load(Ordering::Relaxed).max(0) as usize
    }

    /// The distance to the nearest triangle and its number.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<(f32, u32)> {
        let mut hit = RayHit::new(ray);
        // SAFETY: the scene is committed and lives for ever; the ray is aligned and larger than `RTCRayHit`.
        unsafe { (self.intersect)(self.scene, &raw mut hit, std::ptr::null()) };
        (hit.geom_id != INVALID).then_some((hit.tfar, hit.prim_id))
    }

    /// Whether anything is met.
    #[inline]
    pub fn any(&self, ray: &Ray) -> bool {
        let mut hit = RayHit::new(ray);
        // SAFETY: as in `closest`; `RTCRay` is the front of `RTCRayHit`.
        unsafe { (self.occluded)(self.scene, &raw mut hit, std::ptr::null()) };
        hit.tfar < 0.0
    }
}
