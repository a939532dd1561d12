//! How numbers of an actuator follow the temperature of its winding.
//!
//! ```text
//! k_e, R      p = p₀·(1 + α·ΔT)         metals and magnets
//! F, c        p = p₀·exp(α·ΔT)          lubricants; dry friction static and kinetic alike
//! ```
//!
//! with `ΔT` the winding's temperature less that of the model file's numbers.

/// Number of an actuator that follows the temperature.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum ThermalNumber {
    /// Peak back-EMF over speed, the torque constant.
    BackEmf,
    /// Resistance of the winding.
    Resistance,
    /// Dry friction, static and kinetic together.
    DryFriction,
    /// Viscous drag of the motor.
    Viscous,
}

impl ThermalNumber {
    /// Every number, in the order of the model file.
    pub const ALL: [Self; 4] = [Self::BackEmf, Self::Resistance, Self::DryFriction, Self::Viscous];

    /// Key of its coefficient below `[temperature]`.
    pub fn key(self) -> &'static str {
        match self {
            Self::BackEmf => "back-emf-per-k",
            Self::Resistance => "resistance-per-k",
            Self::DryFriction => "dry-friction-per-k",
            Self::Viscous => "viscous-per-k",
        }
    }

    /// The number over its value at the model file's temperature, at a coefficient and `ΔT`.
    ///
    /// Linear laws end at a hundredth of the number.
    pub fn ratio(self, per_k: f64, away_k: f64) -> f64 {
        let change = per_k * away_k;
        match self {
            Self::BackEmf | Self::Resistance => (1.0 + change).max(0.01),
            Self::DryFriction | Self::Viscous => libm::exp(change),
        }
    }
}

/// Temperature coefficient of a number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ThermalCoefficient {
    /// Relative change, 1/K.
    pub per_k: f64,
    /// Standard deviation between units, 1/K.
    pub std_per_k: f64,
}

/// How an actuator's numbers follow the temperature of its winding.
///
/// # Examples
///
/// ```
/// use ema_sim::{ThermalNumber, presets::ema_48_temperature};
///
/// let law = ema_48_temperature();
/// let alpha = law.coefficient(ThermalNumber::Resistance).per_k;
/// // copper, 50 K warmer
/// assert!((ThermalNumber::Resistance.ratio(alpha, 50.0) - 1.195).abs() < 1e-3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TemperatureLaw {
    /// Temperature of the winding that the model file's numbers are of, K.
    pub nominal_k: f64,
    /// Coefficients in the order of [`ThermalNumber::ALL`].
    pub coefficients: [ThermalCoefficient; 4],
}

impl TemperatureLaw {
    /// The coefficient of a number.
    pub fn coefficient(&self, number: ThermalNumber) -> ThermalCoefficient {
        self.coefficients[number as usize]
    }
}
