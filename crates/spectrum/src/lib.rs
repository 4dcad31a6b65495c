//! Wavelengths, spectra, colour spaces, RGB to spectrum, measured tables.
