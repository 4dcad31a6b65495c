//! Where the sun stands at a time and a place (Blanco-Muriel et al. 2001, "Computing the solar vector").

use std::f64::consts::TAU;
use steradian_math::{Vec3, asin, atan2, safe_acos, sin_cos};

/// A time by the clocks of a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    /// Year, month from 1, day from 1.
    pub date: [i64; 3],
    /// Hours, minutes, seconds.
    pub time: [f64; 3],
    /// How many hours the clocks are ahead of universal time.
    pub timezone: f64,
    /// Degrees north.
    pub latitude: f64,
    /// Degrees east.
    pub longitude: f64,
}

/// Mean radius of the earth over its distance from the sun.
const PARALLAX: f32 = 6371.01 / 149_597_890.0;

impl Moment {
    /// The unit direction to the sun: x to the south, y to the west, z up.
    pub fn sun(&self) -> Vec3 {
        let hours = self.time[0] - self.timezone + (self.time[1] + self.time[2] / 60.0) / 60.0;
        let days = self.days() - 0.5 + hours / 24.0;
        let (anomaly, omega) = (6.2400600 + 0.0172019699 * days, 2.1429 - 0.0010394594 * days);
        let longitude =
            4.8950630 + 0.017202791698 * days + 0.03341607 * sine(anomaly) + 0.00034894 * sine(2.0 * anomaly)
                - 0.0001134
                - 0.0000203 * sine(omega);
        let obliquity = 0.4090928 - 6.2140e-9 * days + 0.0000396 * sine(omega + 0.25 * TAU);
        let ((sin_l, cos_l), (sin_o, cos_o)) = (around(longitude), around(obliquity));
        let right_ascension = atan2(cos_o * sin_l, cos_l);
        let declination = asin((sin_o * sin_l).clamp(-1.0, 1.0));
        let sidereal = 6.6974243242 + 0.0657098283 * days + hours;
        let hour_angle = (sidereal * 15.0 + self.longitude).to_radians() - f64::from(right_ascension);
        let ((sin_h, cos_h), (sin_d, cos_d)) = (around(hour_angle), sin_cos(declination));
        let (sin_p, cos_p) = around(self.latitude.to_radians());
        let zenith = safe_acos(cos_p * cos_h * cos_d + sin_d * sin_p);
        let zenith = zenith + PARALLAX * sin_cos(zenith).0;
        // From north over east.
        let azimuth = atan2(-sin_h * cos_d, sin_d * cos_p - cos_d * sin_p * cos_h);
        let ((sin_z, cos_z), (sin_a, cos_a)) = (sin_cos(zenith), sin_cos(azimuth));
        Vec3::new(-sin_z * cos_a, -sin_z * sin_a, cos_z)
    }

    /// Whole days from noon of the first of January 2000 to noon of the date (Fliegel and van Flandern 1968).
    fn days(&self) -> f64 {
        let [year, month, day] = self.date;
        let a = (month - 14) / 12;
        let number = (1461 * (year + 4800 + a)) / 4 + (367 * (month - 2 - 12 * a)) / 12
            - (3 * ((year + 4900 + a) / 100)) / 4
            + day
            - 32075;
        (number - 2_451_545) as f64
    }
}

/// Sine and cosine of an angle of many turns.
fn around(angle: f64) -> (f32, f32) {
    sin_cos((angle - TAU * (angle / TAU).round()) as f32)
}

fn sine(angle: f64) -> f64 {
    f64::from(around(angle).0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_stands_where_almanacs_say() {
        let tokyo = Moment {
            date: [2010, 7, 10],
            time: [15.0, 0.0, 0.0],
            timezone: 9.0,
            latitude: 35.6894,
            longitude: 139.6917,
        };
        let near = |m: Moment, want: [f32; 3]| {
            let d = m.sun();
            let off = (d - Vec3::from_array(want)).length();
            assert!(off < 1e-3, "{d:?} is not {want:?}");
        };
        // As Mitsuba 3.9.1 has them, whose arithmetic is of single precision.
        near(tokyo, [0.0513854, 0.691748, 0.720308]);
        let zurich =
            Moment { date: [2024, 6, 21], time: [8.5, 30.0, 0.0], timezone: 2.0, latitude: 47.4, longitude: 8.5 };
        near(zurich, [-0.00498345, -0.844377, 0.535726]);
        // Solar noon at the equator on an equinox: overhead, but for the equation of time.
        let equinox =
            Moment { date: [2024, 3, 20], time: [12.0, 7.4, 0.0], timezone: 0.0, latitude: 0.0, longitude: 0.0 };
        assert!(equinox.sun().z > 0.9999, "{:?}", equinox.sun());
        let summer = Moment { date: [2024, 6, 20], latitude: 51.5, ..equinox };
        let height = 90.0 - safe_acos(summer.sun().z).to_degrees();
        assert!((height - (90.0 - 51.5 + 23.44)).abs() < 0.1, "{height}");
    }
}
