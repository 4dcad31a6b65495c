//! The embedded tables of numbers: lines of `wavelength,value,...`, `#` starts a comment.

/// All rows of an embedded table. Its shape is checked by a test, so that a line that does not parse can simply be left out here.
pub(crate) fn rows<const N: usize>(text: &str) -> Vec<(f32, [f32; N])> {
    text.lines().filter_map(row).collect()
}

/// One row, or `None` for a comment or a line of another shape.
pub(crate) fn row<const N: usize>(line: &str) -> Option<(f32, [f32; N])> {
    let mut cells = line.split(',').map(|cell| cell.trim().parse::<f32>().ok());
    let lambda = cells.next()??;
    let mut values = [0.0; N];
    for value in &mut values {
        *value = cells.next()??;
    }
    cells.next().is_none().then_some((lambda, values))
}
