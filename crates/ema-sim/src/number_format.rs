//! Numbers and bounds as error messages show them.

use core::fmt;

/// A number as a message shows it, in powers of ten where it is long.
pub(crate) struct Told(pub(crate) f64);

impl fmt::Display for Told {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plain = self.0 == 0.0 || (1e-6..1e12).contains(&self.0.abs()) || !self.0.is_finite();
        if plain { write!(f, "{}", self.0) } else { write!(f, "{:e}", self.0) }
    }
}

/// A number expected between two bounds; bounds that only say above zero or finite in words.
pub(crate) struct Expected(pub(crate) f64, pub(crate) f64);

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (least, most) = (self.0, self.1);
        match (least, most == f64::MAX) {
            (f64::MIN, true) => write!(f, "a finite number"),
            (f64::MIN_POSITIVE, true) => write!(f, "a number above 0"),
            (f64::MIN_POSITIVE, false) => write!(f, "a number above 0, to {}", Told(most)),
            (_, true) => write!(f, "a number of at least {}", Told(least)),
            (_, false) => write!(f, "a number from {} to {}", Told(least), Told(most)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_that_only_say_above_zero_are_told_in_words() {
        let told = |least, most| Expected(least, most).to_string();
        assert_eq!(told(f64::MIN_POSITIVE, f64::MAX), "a number above 0");
        assert_eq!(told(f64::MIN_POSITIVE, 1e6), "a number above 0, to 1000000");
        assert_eq!(told(0.0, f64::MAX), "a number of at least 0");
        assert_eq!(told(-f64::MAX, f64::MAX), "a finite number");
        assert_eq!(told(0.01, 1.0), "a number from 0.01 to 1");
        assert_eq!(Told(-2.5).to_string(), "-2.5");
        assert_eq!(Told(1e300).to_string(), "1e300");
        assert_eq!(Told(f64::NAN).to_string(), "NaN");
    }
}
