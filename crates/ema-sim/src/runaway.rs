//! Why a run ended early: its shaft was driven away.

use core::fmt;

use crate::{
    effect::{EffectId, Geometry},
    number_format::Told,
};

/// A run that ended early, since its shaft went beyond any speed that the machine could make.
#[derive(Clone, Debug, PartialEq)]
pub struct Runaway {
    /// When, from the start of the test.
    pub time_s: f64,
    /// Speed of the motor then, rad/s, of a linear axis m/s.
    pub speed: f64,
    /// Speed beyond which a run ends: of an actuator a hundred times the one at which its
    /// back-EMF is all of its supply, of an axis ten times what its drive, offset and load make
    /// in the whole test; start and load are added to the former.
    pub most: f64,
    /// Unit of both.
    pub geometry: Geometry,
    /// The effects of the model that can put energy into the motion, in its order.
    pub feeding: Vec<EffectId>,
}

impl fmt::Display for Runaway {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = match self.geometry {
            Geometry::Rotary => "rad/s",
            Geometry::Linear => "m/s",
        };
        let [time_s, speed, most] = [self.time_s, self.speed, self.most].map(brief);
        write!(
            f,
            "the machine is driven away: {speed} {unit} at {time_s} s, beyond the {most} {unit} \
             that its drive and load could ever make; "
        )?;
        let Some((last, others)) = self.feeding.split_last() else {
            return write!(
                f,
                "no effect of the model feeds the motion: loop, load or parameters are unstable, \
                 or an effect is too strong to be followed"
            );
        };
        for id in others {
            write!(f, "{}, ", Named(*id))?;
        }
        write!(f, "{} can feed the motion", Named(*last))
    }
}

/// A number to four digits.
fn brief(x: f64) -> Told {
    if x == 0.0 || !x.is_finite() {
        return Told(x);
    }
    // by a whole power, so that the digits stay decimal ones
    let exponent = 3 - libm::floor(libm::log10(x.abs())) as i32;
    let scale = libm::pow(10.0, f64::from(exponent.abs()));
    Told(if exponent < 0 { libm::round(x / scale) * scale } else { libm::round(x * scale) / scale })
}

/// An effect as a message calls it.
struct Named(EffectId);

impl fmt::Display for Named {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.0.info().symbol, self.0.info().name)
    }
}
