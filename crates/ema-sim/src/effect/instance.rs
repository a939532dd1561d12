//! An effect with the values of its numbers.

use crate::effect::{
    catalogue::{self, EffectId},
    curve::Curve,
    error::EffectError,
    lanes::EffectLanes,
    law::{EffectLaw, Given},
    number::{MOST_PARAMETERS, Role},
    quantity::Geometry,
    shaft_load::{Moment, ShaftLoad, ShaftMoment, ShaftTorque},
};

/// An effect with its numbers.
///
/// # Examples
///
/// ```
/// use ema_sim::{Effect, EffectId, Geometry, HealthState, LowFidelity, Scenario, presets::EMA_48};
///
/// let cogging = Effect::new(EffectId::Cogging, Geometry::Rotary)
///     .with("cogging_sin_n_m", 0.004)?
///     .with("order", 24.0)?;
/// let model = LowFidelity::new(&EMA_48, &Scenario::chirp())?.with_effects(&[cogging])?;
/// let trace = model.simulate(&(&HealthState::HEALTHY).into());
/// assert_eq!(trace.current_a.len(), 5000);
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    id: EffectId,
    geometry: Geometry,
    values: [f64; MOST_PARAMETERS],
    curve: Option<Curve>,
}

impl Effect {
    /// An effect that does nothing yet.
    pub fn new(id: EffectId, geometry: Geometry) -> Self {
        let mut values = [0.0; MOST_PARAMETERS];
        for (value, parameter) in values.iter_mut().zip(id.info().parameters) {
            *value = parameter.default_value(geometry);
        }
        Self { id, geometry, values, curve: None }
    }

    /// A measured curve.
    pub fn tabulated(curve: Curve, geometry: Geometry) -> Self {
        Self::with_curve(EffectId::Tabulated, curve, geometry)
    }

    /// An effect that takes a curve, whose first number scales it: by one.
    pub(crate) fn with_curve(id: EffectId, curve: Curve, geometry: Geometry) -> Self {
        let mut effect = Self::new(id, geometry);
        effect.values[0] = 1.0;
        effect.curve = Some(curve);
        effect
    }

    /// Which effect.
    pub fn id(&self) -> EffectId {
        self.id
    }

    /// The units of its numbers.
    pub fn geometry(&self) -> Geometry {
        self.geometry
    }

    /// The measured curve of a tabulated effect.
    pub fn curve(&self) -> Option<&Curve> {
        self.curve.as_ref()
    }

    /// A number by its key.
    pub fn get(&self, key: &str) -> Option<f64> {
        self.place(key).map(|place| self.values[place])
    }

    /// Values of the numbers, in the order of [`EffectInfo::parameters`](crate::EffectInfo).
    pub fn values(&self) -> &[f64] {
        &self.values[..self.id.info().parameters.len()]
    }

    /// The effect with one number replaced.
    ///
    /// # Errors
    ///
    /// As [`set`](Self::set).
    pub fn with(mut self, key: &str, value: f64) -> Result<Self, EffectError> {
        self.set(key, value)?;
        Ok(self)
    }

    /// Replaces a number.
    ///
    /// # Errors
    ///
    /// [`EffectError`] for a key that the effect does not have or a value out of its bounds.
    pub fn set(&mut self, key: &str, value: f64) -> Result<(), EffectError> {
        let unknown = || EffectError::UnknownKey { effect: self.id, key: key.to_owned() };
        let place = self.place(key).ok_or_else(unknown)?;
        let parameter = &self.id.info().parameters[place];
        let (least, most) = parameter.bounds();
        if !(least..=most).contains(&value) {
            let key = parameter.key(self.geometry);
            return Err(EffectError::OutOfBounds { effect: self.id, key, value, least, most });
        }
        self.values[place] = value;
        Ok(())
    }

    /// True where all its sizes are zero, so that it changes nothing.
    pub fn is_off(&self) -> bool {
        let info = self.id.info();
        let mut numbers = info.parameters.iter().zip(self.values);
        let sized = numbers.any(|(parameter, v)| parameter.role() == Role::Amplitude && v != 0.0);
        !sized || (info.takes_curve && self.curve.as_ref().is_none_or(Curve::is_zero))
    }

    fn place(&self, key: &str) -> Option<usize> {
        self.id.info().parameters.iter().position(|p| p.key(self.geometry) == key)
    }

    /// True where its torque can put energy into the motion, and not only brake or hold.
    pub(crate) fn can_feed(&self) -> bool {
        self.law(|law| law.can_feed())
    }

    /// True where it adds dry friction.
    pub(crate) fn rubs(&self) -> bool {
        !self.is_off() && self.law(|law| law.rubs())
    }

    /// Error of the position that a servo axis shows where it stands, at rest.
    pub(crate) fn error_of_position(&self, position: f64) -> f64 {
        self.law(|law| law.error_of_position(position))
    }

    /// Asks the law of the effect, with its numbers.
    pub(crate) fn law<T>(&self, ask: impl FnOnce(&dyn EffectLaw) -> T) -> T {
        catalogue::with_law(self.id, &self.given(), ask)
    }

    /// The effect for so many runs, without numbers yet; `None` where it takes a curve.
    pub(crate) fn in_lanes<const N: usize>(&self) -> Option<EffectLanes<N>> {
        self.curve.is_none().then(|| EffectLanes::new(self.id, self.geometry))
    }

    /// All numbers, in the order of the parameters.
    pub(crate) fn all_values(&self) -> &[f64; MOST_PARAMETERS] {
        &self.values
    }

    /// Adds what it does on the moving shaft.
    #[inline]
    pub(crate) fn load(&self, at: &Moment, shaft: &mut ShaftLoad) {
        catalogue::load(self.id, &self.given(), at, shaft);
    }

    /// Torque on the shaft of a machine that is not one of this crate: a shaft without a gear and
    /// without a load.
    ///
    /// # Examples
    ///
    /// ```
    /// use ema_sim::{Effect, EffectId, Geometry, ShaftMoment};
    ///
    /// let gravity =
    ///     Effect::new(EffectId::Imbalance, Geometry::Rotary).with("imbalance_cos_n_m", 0.3)?;
    /// let level = ShaftMoment { position: 0.0, speed: 1.0, time_s: 0.0 };
    /// assert_eq!(gravity.on_shaft(&level).against, 0.3);
    /// # Ok::<_, ema_sim::EffectError>(())
    /// ```
    pub fn on_shaft(&self, at: &ShaftMoment) -> ShaftTorque {
        let mut shaft = ShaftLoad::new(0.0);
        let moment = Moment {
            motor_rad: at.position,
            speed_rad_per_s: at.speed,
            position_rad: at.position,
            time_s: at.time_s,
            motor_n_m: 0.0,
            load_n_m: 0.0,
            per_gear_ratio: 1.0,
            since_commutation_s: 0.0,
        };
        self.load(&moment, &mut shaft);
        let dry = shaft.dry_n_m.map(|[kinetic, _]| kinetic);
        ShaftTorque { against: shaft.against_n_m, dry }
    }

    #[inline]
    fn given(&self) -> Given<'_> {
        Given { values: &self.values, curve: self.curve.as_ref(), geometry: self.geometry }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_is_complete_and_off_by_default() {
        for (n, id) in EffectId::ALL.into_iter().enumerate() {
            let info = id.info();
            let symbol =
                if id == EffectId::Tabulated { "U".to_owned() } else { format!("E{:02}", n + 1) };
            assert_eq!(info.symbol, symbol);
            assert!((1..=MOST_PARAMETERS).contains(&info.parameters.len()), "{symbol}");
            for text in [info.name, info.equation, info.mimics, info.separated_by, info.source] {
                assert!(!text.is_empty(), "{symbol}");
            }
            for geometry in [Geometry::Rotary, Geometry::Linear] {
                assert!(Effect::new(id, geometry).is_off(), "{symbol}");
                for parameter in info.parameters {
                    let (least, most) = parameter.bounds();
                    let value = parameter.default_value(geometry);
                    assert!(least <= value && value <= most, "{symbol}: {parameter:?}");
                    assert_eq!(EffectId::find(info.symbol), Some(id));
                    if parameter.role() == Role::Amplitude {
                        assert_eq!(value, 0.0, "{symbol}: {parameter:?}");
                    }
                    let ending = parameter.quantity().key_ending(geometry);
                    assert!(parameter.key(geometry).ends_with(ending), "{symbol}: {parameter:?}");
                    for value in parameter.grid(geometry) {
                        assert!(least <= value && value <= most, "{symbol}: {parameter:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_number_out_of_bounds_is_refused_by_name() {
        let error = Effect::new(EffectId::Stribeck, Geometry::Linear)
            .with("stribeck_n", -1.0)
            .unwrap_err()
            .to_string();
        assert!(error.starts_with("`stribeck_n` of effect E01 is -1"), "{error}");
        let error = Effect::new(EffectId::Stribeck, Geometry::Linear)
            .with("stribeck_n_m", 1.0)
            .unwrap_err()
            .to_string();
        assert_eq!(error, "effect E01 has no parameter `stribeck_n_m`");
    }
}
