//! A physically based Monte Carlo renderer: the command line as a library, the binary, and the small public face.
