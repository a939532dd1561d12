/// A complex number, plain data.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Complex {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

impl Complex {
    /// The number `re + i·im`.
    pub const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }

    /// Modulus, without overflow of the squares.
    pub fn modulus(self) -> f64 {
        self.re.hypot(self.im)
    }

    /// Argument in radians, in (−π, π].
    pub fn argument_rad(self) -> f64 {
        self.im.atan2(self.re)
    }

    /// Complex conjugate.
    #[must_use]
    pub fn conjugate(self) -> Self {
        Self::new(self.re, -self.im)
    }

    /// Integer power by repeated squaring.
    #[must_use]
    pub fn power(self, mut exponent: u32) -> Self {
        let (mut base, mut result) = (self, Self::new(1.0, 0.0));
        while exponent > 0 {
            if exponent & 1 == 1 {
                result = result * base;
            }
            base = base * base;
            exponent >>= 1;
        }
        result
    }
}

impl std::ops::Mul for Complex {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self::new(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)
    }
}

impl std::ops::Add for Complex {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }
}

impl std::ops::Sub for Complex {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, self.im - other.im)
    }
}

#[cfg(test)]
mod tests {
    use super::Complex;

    #[test]
    fn power_of_the_imaginary_unit_cycles() {
        let i = Complex::new(0.0, 1.0);
        assert_eq!(i.power(0), Complex::new(1.0, 0.0));
        assert_eq!(i.power(2), Complex::new(-1.0, 0.0));
        assert_eq!(i.power(5), i);
        assert_eq!(i.conjugate() * i, Complex::new(1.0, 0.0));
    }
}
