//! Pixel buffers, image files, reconstruction filters, tone mapping, error metrics.
