//! Physical quantities of an effect's numbers, with their units in both geometries.

/// Geometry of a machine, which turns or slides: the units of its effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Geometry {
    /// Angles in rad, torques in N·m.
    Rotary,
    /// Lengths in m, forces in N.
    Linear,
}

impl Geometry {
    /// Both geometries.
    pub const ALL: [Self; 2] = [Self::Rotary, Self::Linear];

    /// The name in reports: `rotary`, `linear`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rotary => "rotary",
            Self::Linear => "linear",
        }
    }
}

/// Physical quantity of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantity {
    /// Torque, of a linear machine force.
    Torque,
    /// Torque over current, or over voltage where a voltage drives the machine.
    TorqueConstant,
    /// Torque over speed.
    Drag,
    /// Torque over angle.
    Stiffness,
    /// Angle over torque.
    Compliance,
    /// Inertia, of a linear machine mass.
    Inertia,
    /// Angle, of a linear machine length.
    Angle,
    /// Angle of the electrical period, in rad in both geometries.
    ElectricalAngle,
    /// Speed.
    Speed,
    /// Periods a turn, of a linear machine the wave number.
    Order,
    /// Frequency.
    Frequency,
    /// Time.
    Time,
    /// Current.
    Current,
    /// Voltage.
    Voltage,
    /// Resistance.
    Resistance,
    /// Inductance.
    Inductance,
    /// Relative change over the square of a current.
    PerCurrentSquared,
    /// Relative change over a temperature.
    PerKelvin,
    /// Temperature over power.
    ThermalResistance,
    /// Share or relative change.
    Ratio,
    /// Plain number.
    Number,
}

impl Quantity {
    /// Unit in a geometry, as text for people: `N·m·s/rad`; empty for a plain number.
    ///
    /// # Examples
    ///
    /// ```
    /// use ema_sim::{Geometry, Quantity};
    ///
    /// assert_eq!(Quantity::Drag.unit(Geometry::Linear), "N·s/m");
    /// ```
    pub fn unit(self, geometry: Geometry) -> &'static str {
        self.spelt(geometry)[0]
    }

    /// End of the keys of numbers of this quantity: `n_m_s_per_rad`.
    pub fn key_ending(self, geometry: Geometry) -> &'static str {
        self.spelt(geometry)[1]
    }

    fn spelt(self, geometry: Geometry) -> [&'static str; 2] {
        let by = |rotary, linear| match geometry {
            Geometry::Rotary => rotary,
            Geometry::Linear => linear,
        };
        match self {
            Self::Torque => by(["N·m", "n_m"], ["N", "n"]),
            Self::TorqueConstant => by(["N·m/A", "n_m_per_a"], ["N/A", "n_per_a"]),
            Self::Drag => by(["N·m·s/rad", "n_m_s_per_rad"], ["N·s/m", "n_s_per_m"]),
            Self::Stiffness => by(["N·m/rad", "n_m_per_rad"], ["N/m", "n_per_m"]),
            Self::Compliance => by(["rad/(N·m)", "rad_per_n_m"], ["m/N", "m_per_n"]),
            Self::Inertia => by(["kg·m²", "kg_m2"], ["kg", "kg"]),
            Self::Angle => by(["rad", "rad"], ["m", "m"]),
            Self::ElectricalAngle => ["rad", "rad"],
            Self::Speed => by(["rad/s", "rad_per_s"], ["m/s", "m_per_s"]),
            Self::Order => by(["1/turn", ""], ["rad/m", "rad_per_m"]),
            Self::Frequency => ["Hz", "hz"],
            Self::Time => ["s", "s"],
            Self::Current => ["A", "a"],
            Self::Voltage => ["V", "v"],
            Self::Resistance => ["Ω", "ohm"],
            Self::Inductance => ["H", "henry"],
            Self::PerCurrentSquared => ["1/A²", "per_a2"],
            Self::PerKelvin => ["1/K", "per_k"],
            Self::ThermalResistance => ["K/W", "k_per_w"],
            Self::Ratio => ["1", "ratio"],
            Self::Number => ["", ""],
        }
    }
}
