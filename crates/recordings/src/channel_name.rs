//! Names and units of channels: one table.
//!
//! # Adding a channel
//!
//! Add its line to the table `channels!` below: the variant of [`ChannelName`], the name of the
//! column with its SI unit, the unit, the group, and the meaning. Readers, writers, maps, messages
//! and the published table of columns follow from it.

use std::fmt;

/// Group of a channel in the table of columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelKind {
    /// Angles, speeds and torques of a rotary actuator.
    Rotary,
    /// Positions, speeds and forces of a linear actuator.
    Linear,
    /// Currents and voltages.
    Electrical,
    /// Anything else.
    Other,
}

impl ChannelKind {
    /// The word used in the table of columns.
    pub fn label(self) -> &'static str {
        match self {
            Self::Rotary => "rotary",
            Self::Linear => "linear",
            Self::Electrical => "electrical",
            Self::Other => "other",
        }
    }
}

macro_rules! channels {
    ($($variant:ident $column:literal $unit:literal $kind:ident $meaning:literal;)+) => {
        /// A channel that the format knows.
        ///
        /// The column's name states the SI unit.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum ChannelName {
            $(#[doc = concat!("`", $column, "`, ", $unit, ": ", $meaning, ".")] $variant,)+
        }

        impl ChannelName {
            /// Every channel, in the order of the table of columns.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];

            /// The name of the column, for instance `current_a`.
            pub fn column(self) -> &'static str {
                match self { $(Self::$variant => $column,)+ }
            }

            /// The unit of the values, `1` for a pure number.
            pub fn unit(self) -> &'static str {
                match self { $(Self::$variant => $unit,)+ }
            }

            /// The group in the table of columns.
            pub fn kind(self) -> ChannelKind {
                match self { $(Self::$variant => ChannelKind::$kind,)+ }
            }

            /// Description of the channel, in a few words.
            pub fn meaning(self) -> &'static str {
                match self { $(Self::$variant => $meaning,)+ }
            }

            /// The channel of a column, if that column is one.
            pub fn from_column(column: &str) -> Option<Self> {
                match column { $($column => Some(Self::$variant),)+ _ => None }
            }
        }
    };
}

channels! {
    Command "command_rad" "rad" Rotary "commanded surface angle";
    SpeedCommand "speed_command_rad_per_s" "rad/s" Rotary "commanded surface speed";
    SurfaceAngle "surface_angle_rad" "rad" Rotary "surface angle";
    MotorAngle "motor_angle_rad" "rad" Rotary "mechanical rotor angle, zero where phase A has electrical angle zero";
    MotorSpeed "motor_speed_rad_per_s" "rad/s" Rotary "rotor speed";
    Load "load_n_m" "N·m" Rotary "load torque on the surface";
    LinearCommand "command_m" "m" Linear "commanded position";
    LinearSpeedCommand "speed_command_m_per_s" "m/s" Linear "commanded speed";
    Position "position_m" "m" Linear "position of the output";
    LinearSpeed "speed_m_per_s" "m/s" Linear "speed of the output";
    Force "force_n" "N" Linear "force at the output";
    Current "current_a" "A" Electrical "stator current envelope, as the metadata name it";
    PhaseACurrent "phase_a_current_a" "A" Electrical "current of phase A";
    PhaseBCurrent "phase_b_current_a" "A" Electrical "current of phase B";
    PhaseCCurrent "phase_c_current_a" "A" Electrical "current of phase C";
    QAxisCurrent "q_axis_current_a" "A" Electrical "quadrature-axis current";
    PhaseAVoltage "phase_a_voltage_v" "V" Electrical "voltage of phase A";
    PhaseBVoltage "phase_b_voltage_v" "V" Electrical "voltage of phase B";
    PhaseCVoltage "phase_c_voltage_v" "V" Electrical "voltage of phase C";
    QAxisVoltage "q_axis_voltage_v" "V" Electrical "quadrature-axis voltage";
    MotorVoltage "motor_voltage_v" "V" Electrical "voltage applied to the motor";
    Voltage "voltage_v" "V" Electrical "drive voltage";
    Duty "duty_frac" "1" Electrical "duty ratio of the inverter, -1 to 1";
    BusVoltage "bus_voltage_v" "V" Electrical "voltage of the supply";
    HallState "hall_state" "1" Electrical "commutation sector, 1 to 6";
    WindingTemperature "winding_temperature_k" "K" Other "temperature of the winding";
}

impl fmt::Display for ChannelName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.column())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_is_found_by_its_column() {
        for &name in ChannelName::ALL {
            assert_eq!(ChannelName::from_column(name.column()), Some(name));
        }
        assert_eq!(ChannelName::from_column("time_s"), None);
    }
}
