//! Measured media by name: Jensen et al. 2001 and Narasimhan et al. 2006.

/// Reduced scattering and absorption per millimetre, linear sRGB, by name.
const TABLE: &str = include_str!("../../../data/media.csv");

/// A measured medium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::pbrt) struct Preset {
    /// Reduced scattering coefficient per millimetre.
    pub sigma_s: [f32; 3],
    /// Absorption coefficient per millimetre.
    pub sigma_a: [f32; 3],
}

fn rows() -> impl Iterator<Item = &'static str> {
    TABLE.lines().filter(|l| !l.starts_with('#')).skip(1)
}

/// The names of all media in the table.
pub(in crate::pbrt) fn names() -> impl Iterator<Item = &'static str> {
    rows().filter_map(|row| row.split(',').next())
}

/// The medium of that name.
pub(in crate::pbrt) fn find(name: &str) -> Option<Preset> {
    let row = rows().find(|row| row.split(',').next() == Some(name))?;
    let numbers: Vec<f32> = row.split(',').skip(1).filter_map(|v| v.parse().ok()).collect();
    let &[sr, sg, sb, ar, ag, ab] = numbers.as_slice() else { return None };
    Some(Preset { sigma_s: [sr, sg, sb], sigma_a: [ar, ag, ab] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_whole() {
        assert_eq!(names().count(), 47);
        for name in names() {
            let p = find(name).unwrap_or_else(|| panic!("{name}"));
            assert!(p.sigma_s.iter().chain(&p.sigma_a).all(|&v| (0.0..100.0).contains(&v)), "{name}");
        }
        let skin = Preset { sigma_s: [1.09, 1.59, 1.79], sigma_a: [0.013, 0.070, 0.145] };
        assert_eq!((find("Skin2"), find("skin2")), (Some(skin), None));
    }
}
