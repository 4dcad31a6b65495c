//! Intel Open Image Denoise, loaded while the program runs: the one module of this crate that calls foreign code.
//!
//! Nothing of the library is needed to build or to render. Versions 1.4 and 2 are known; their functions are declared as their
//! header `oidn.h` has them.
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};

use libloading::Library;

type Handle = *mut c_void;

/// As much memory as the library takes where nobody limits it.
const MOST_MEGABYTES: c_int = 3000;

/// A picture of three floats a pixel.
const FLOAT3: c_int = 3;

/// The library and a device of it. It stays loaded until the program ends: its threads may outlive the device, and would
/// wake up to code that is gone.
pub(crate) struct Oidn {
    library: ManuallyDrop<Library>,
    device: Handle,
    /// Where it was found.
    pub path: PathBuf,
}

/// What one denoising reads.
pub(crate) struct Pictures<'a> {
    /// Width and height.
    pub size: [usize; 2],
    /// What is to be denoised, three floats a pixel.
    pub color: &'a [f32],
    /// Its name to the library: `color`, `albedo` or `normal`.
    pub name: &'static str,
    /// Albedo and normals that are without noise.
    pub guides: Option<[&'a [f32]; 2]>,
    /// Memory in bytes that the library may take for itself, roughly: it cuts the picture into tiles to keep to it.
    pub memory: u64,
}

impl Oidn {
    /// The library, from wherever it is: `STERADIAN_OIDN`, where the system looks, or a Python environment.
    ///
    /// # Errors
    /// Where it was looked for, and how to get it.
    pub fn load() -> Result<Oidn, String> {
        let mut refused = String::new();
        for path in candidates() {
            match Oidn::open(&path) {
                Ok(oidn) => return Ok(oidn),
                Err(what) if path.is_absolute() => refused = format!(" ({}: {what})", path.display()),
                Err(_) => {}
            }
        }
        Err(format!(
            "Open Image Denoise is not here{refused}; get it with `pip install oidn`, as a package of your system, or from \
             openimagedenoise.org, and name its folder in STERADIAN_OIDN if it is not found"
        ))
    }

    fn open(path: &Path) -> Result<Oidn, String> {
        if let Some(folder) = path.parent().filter(|p| p.is_absolute()) {
            load_tbb(folder);
        }
        // SAFETY: loading runs the library's initialisers. The user put it where we look, as any program trusts its libraries.
        let library = ManuallyDrop::new(unsafe { Library::new(path) }.map_err(|e| e.to_string())?);
        // SAFETY: the types are those of oidn.h; a device is committed before use and released in `drop`.
        let device = unsafe {
            let new: unsafe extern "C" fn(c_int) -> Handle = function(&library, c"oidnNewDevice")?;
            let commit: unsafe extern "C" fn(Handle) = function(&library, c"oidnCommitDevice")?;
            let device = new(0);
            if device.is_null() {
                return Err("it has no device for this machine".into());
            }
            commit(device);
            device
        };
        let oidn = Oidn { library, device, path: path.to_owned() };
        oidn.check()?;
        Ok(oidn)
    }

    /// Denoises a picture of light or of a guide.
    ///
    /// # Errors
    /// The library's words.
    pub fn denoise(&self, p: &Pictures) -> Result<Vec<f32>, String> {
        let [width, height] = p.size;
        let length = width * height * 3;
        let fits = p.color.len() == length && p.guides.is_none_or(|g| g.iter().all(|v| v.len() == length));
        if !fits || length == 0 {
            return Err("the pictures differ in size".into());
        }
        let mut out = vec![0.0f32; length];
        // SAFETY: the types are those of oidn.h. Every picture has width * height * 3 floats, checked above, and outlives the
        // filter, which is released before this block ends; inputs are only read, `out` is borrowed by nobody else.
        unsafe {
            type SetImage =
                unsafe extern "C" fn(Handle, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize);
            let new: unsafe extern "C" fn(Handle, *const c_char) -> Handle = function(&self.library, c"oidnNewFilter")?;
            let set: SetImage = function(&self.library, c"oidnSetSharedFilterImage")?;
            let set_bool: unsafe extern "C" fn(Handle, *const c_char, bool) =
                function(&self.library, c"oidnSetFilter1b")
                    .or_else(|_| function(&self.library, c"oidnSetFilterBool"))?;
            let set_int: unsafe extern "C" fn(Handle, *const c_char, c_int) =
                function(&self.library, c"oidnSetFilter1i")
                    .or_else(|_| function(&self.library, c"oidnSetFilterInt"))?;
            let commit: unsafe extern "C" fn(Handle) = function(&self.library, c"oidnCommitFilter")?;
            let execute: unsafe extern "C" fn(Handle) = function(&self.library, c"oidnExecuteFilter")?;
            let release: unsafe extern "C" fn(Handle) = function(&self.library, c"oidnReleaseFilter")?;
            let filter = new(self.device, c"RT".as_ptr());
            let image = |name: &CStr, data: *mut f32| {
                set(filter, name.as_ptr(), data.cast(), FLOAT3, width, height, 0, 0, 0);
            };
            let name = CString::new(p.name).map_err(|e| e.to_string())?;
            image(&name, p.color.as_ptr().cast_mut());
            image(c"output", out.as_mut_ptr());
            if let Some([albedo, normal]) = p.guides {
                image(c"albedo", albedo.as_ptr().cast_mut());
                image(c"normal", normal.as_ptr().cast_mut());
                set_bool(filter, c"cleanAux".as_ptr(), true);
            }
            if p.name == "color" {
                set_bool(filter, c"hdr".as_ptr(), true);
            }
            let megabytes = c_int::try_from(p.memory >> 20).unwrap_or(c_int::MAX).clamp(1, MOST_MEGABYTES);
            set_int(filter, c"maxMemoryMB".as_ptr(), megabytes);
            commit(filter);
            execute(filter);
            release(filter);
        }
        self.check()?;
        Ok(out)
    }

    /// The device's last error, if there is one.
    fn check(&self) -> Result<(), String> {
        let mut message: *const c_char = null();
        // SAFETY: the types are those of oidn.h; the message belongs to the device and is copied at once.
        unsafe {
            let get: unsafe extern "C" fn(Handle, *mut *const c_char) -> c_int =
                function(&self.library, c"oidnGetDeviceError")?;
            if get(self.device, &raw mut message) == 0 {
                return Ok(());
            }
            let words = if message.is_null() { c"no reason given" } else { CStr::from_ptr(message) };
            Err(words.to_string_lossy().into_owned())
        }
    }
}

impl Drop for Oidn {
    fn drop(&mut self) {
        let device = std::mem::replace(&mut self.device, null_mut());
        // SAFETY: the device was made by this library and is released once.
        unsafe {
            if let Ok(release) = function::<unsafe extern "C" fn(Handle)>(&self.library, c"oidnReleaseDevice") {
                release(device);
            }
        }
    }
}

/// A function of the library.
///
/// # Safety
/// `F` must be its type.
unsafe fn function<F: Copy>(library: &Library, name: &CStr) -> Result<F, String> {
    // SAFETY: the caller vouches for the type.
    unsafe { library.get::<F>(name.to_bytes_with_nul()) }.map(|f| *f).map_err(|e| e.to_string())
}

/// Loads the thread library that wheels carry next to it under a name that the system does not find.
fn load_tbb(folder: &Path) {
    if let Some(path) = files_called(folder, "libtbb.so").into_iter().next() {
        // SAFETY: as for the library itself, which says so where it does not find what it needs.
        if let Ok(library) = unsafe { Library::new(path) } {
            std::mem::forget(library);
        }
    }
}

/// Names for the system's loader, and files, in the order of trust.
fn candidates() -> Vec<PathBuf> {
    const STEM: &str = if cfg!(target_os = "macos") { "libOpenImageDenoise" } else { "libOpenImageDenoise.so" };
    let mut out = Vec::new();
    if let Some(named) = std::env::var_os("STERADIAN_OIDN").map(PathBuf::from) {
        if named.is_dir() { out.extend(files_called(&named, STEM)) } else { out.push(named) }
    }
    for name in
        ["libOpenImageDenoise.so.2", "libOpenImageDenoise.so", "libOpenImageDenoise.so.1", "OpenImageDenoise.dll"]
    {
        out.push(name.into());
    }
    out.push("libOpenImageDenoise.dylib".into());
    let homes = [("VIRTUAL_ENV", "lib"), ("CONDA_PREFIX", "lib"), ("HOME", ".local/lib")];
    for lib in homes.iter().filter_map(|(name, lib)| Some(PathBuf::from(std::env::var_os(name)?).join(lib))) {
        out.extend(files_called(&lib, STEM));
        for python in entries(&lib).filter(|p| named_like(p, "python")) {
            for package in entries(&python.join("site-packages")).filter(|p| named_like(p, "oidn")) {
                out.extend(files_called(&package, STEM));
                entries(&package).filter(|p| p.is_dir()).for_each(|folder| out.extend(files_called(&folder, STEM)));
            }
        }
    }
    out
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> {
    let mut all: Vec<_> = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    all.sort();
    all.into_iter()
}

fn named_like(path: &Path, start: &str) -> bool {
    path.file_name().is_some_and(|n| n.to_string_lossy().starts_with(start))
}

fn files_called(folder: &Path, start: &str) -> Vec<PathBuf> {
    entries(folder).filter(|p| named_like(p, start) && p.is_file()).collect()
}
