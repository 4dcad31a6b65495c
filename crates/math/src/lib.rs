//! Points, vectors, normals, frames, transforms, rays, boxes, error bounds and portable elementary functions.
