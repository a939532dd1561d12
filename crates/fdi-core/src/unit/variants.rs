//! The catalogue as it is tried on a machine: each effect with shapes, places, orders and frequencies
//! that are worth looking for.

use core::f64::consts::PI;

use ema_sim::{Effect, EffectId, EffectParameter, Geometry, MachineScales, Role, ShapeScales};

/// Orders that are tried as they are; beyond them multiples of the pole pairs, to twelve of them.
const ORDERS: usize = 12;
/// Places of the surface that are tried, over half of its travel.
const PLACES: [f64; 5] = [-0.8, -0.4, 0.0, 0.4, 0.8];
/// Sizes tried, over the typical one, of an effect that does not grow as its size does.
const SIZES: [f64; 4] = [1.0, 0.1, 0.01, 0.001];
/// Least periods of a vibration in the recording: with fewer it is a drift.
const LEAST_PERIODS: usize = 2;

/// Test and machine that effects are tried in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting {
    pub(crate) scales: MachineScales,
    pub(crate) pole_pairs: u32,
    pub(crate) duration_s: f64,
    /// Highest frequency that the signal keeps, Hz.
    pub(crate) highest_hz: f64,
}

/// An effect in one of its shapes, its sizes zero.
#[derive(Clone, Debug)]
pub(crate) struct Variant {
    pub(crate) effect: Effect,
    /// Size for its slope of each number, or the distance to the next value tried.
    pub(crate) scales: Vec<f64>,
    /// Places of the sizes that are asked about together.
    pub(crate) sizes: Vec<usize>,
}

impl Variant {
    /// The effect with one of its sizes, and that size, for each size asked about.
    pub(crate) fn small(&self) -> Vec<(Effect, f64)> {
        let one = |&place: &usize| {
            let parameter = &self.effect.id().info().parameters[place];
            let size = self.scales[place];
            let effect = self.effect.clone().with(parameter.key(Geometry::Rotary), size).ok()?;
            Some((effect, size))
        };
        self.sizes.iter().filter_map(one).collect()
    }

    /// True for each size asked about that cannot be negative.
    pub(crate) fn is_one_sided(&self) -> Vec<bool> {
        let parameters = self.effect.id().info().parameters;
        self.sizes.iter().map(|&place| parameters[place].bounds().0 >= 0.0).collect()
    }
}

/// Each effect in each of the shapes that are tried.
pub(crate) fn variants(effects: &[EffectId], setting: &Setting) -> Vec<Variant> {
    effects.iter().flat_map(|&id| of_effect(id, setting)).collect()
}

fn of_effect(id: EffectId, setting: &Setting) -> Vec<Variant> {
    let parameters = id.info().parameters;
    let spacing_hz = 1.0 / setting.duration_s;
    let shape_scales =
        ShapeScales { speed: setting.scales.speed.max(1e-9), undivided_inertia: None };
    let usual = Effect::new(id, Geometry::Rotary);
    let mut shapes = vec![usual.clone()];
    for parameter in parameters {
        let tried: Vec<f64> = match parameter.role() {
            Role::Order => orders(setting.pole_pairs),
            Role::Frequency => {
                let count = (setting.highest_hz / spacing_hz) as usize;
                (LEAST_PERIODS..=count).map(|n| n as f64 * spacing_hz).collect()
            }
            Role::Place => PLACES.iter().map(|share| share * setting.scales.travel).collect(),
            Role::Shape(_) if parameters.iter().any(|one| one.role() == Role::Place) => {
                // a region half as wide as two places are apart
                vec![0.2 * setting.scales.travel]
            }
            Role::Shape(_) => parameter.trials(Geometry::Rotary, &shape_scales),
            _ => Vec::new(),
        };
        if tried.is_empty() {
            continue;
        }
        let key = parameter.key(Geometry::Rotary);
        let each = |effect: Effect| {
            tried.iter().filter_map(move |value| effect.clone().with(key, *value).ok())
        };
        shapes = shapes.into_iter().flat_map(each).collect();
    }
    if !shapes.contains(&usual) {
        shapes.push(usual);
    }
    let scale = |parameter: &EffectParameter| match parameter.role() {
        Role::Amplitude => parameter.typical_size(&setting.scales),
        Role::Frequency => 0.5 * spacing_hz,
        Role::Place => 0.4 * setting.scales.travel,
        _ => 0.0,
    };
    let scales: Vec<f64> = parameters.iter().map(scale).collect();
    let steps: &[f64] = if id.info().nonlinear_in_size { &SIZES } else { &SIZES[..1] };
    let mut variants = Vec::new();
    for effect in &shapes {
        for sizes in id.info().size_groups() {
            for times in steps {
                let mut scales = scales.clone();
                for &size in &sizes {
                    scales[size] *= times;
                }
                variants.push(Variant { effect: effect.clone(), scales, sizes: sizes.clone() });
            }
        }
    }
    variants
}

/// Orders of the motor's turn that are tried.
fn orders(pole_pairs: u32) -> Vec<f64> {
    let pairs = pole_pairs as usize;
    let beyond = (1..=ORDERS).map(|times| times * pairs).filter(|order| *order > ORDERS);
    (1..=ORDERS).chain(beyond).map(|order| order as f64).collect()
}

/// Highest frequency of a filter's pass band, Hz.
pub(crate) fn highest_hz(cut_off_hz: f64, output_hz: f64) -> f64 {
    cut_off_hz.min(output_hz / PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_size_of_every_effect_is_asked_about_and_its_usual_shape_is_tried() {
        let setting = Setting {
            scales: MachineScales {
                torque: 0.03,
                drive: 1.0,
                speed: 50.0,
                travel: 5e-3,
                motor_travel: 2.5,
                sample_s: 1e-4,
            },
            pole_pairs: 4,
            duration_s: 0.5,
            highest_hz: 200.0,
        };
        let effects: Vec<EffectId> =
            EffectId::ALL.into_iter().filter(|id| !id.info().takes_curve).collect();
        let all = variants(&effects, &setting);
        // what chance has to choose from
        assert!((200..600).contains(&all.len()), "{}", all.len());
        for id in effects {
            let own: Vec<&Variant> = all.iter().filter(|one| one.effect.id() == id).collect();
            for size in id.info().size_groups().concat() {
                assert!(own.iter().any(|one| one.sizes.contains(&size)), "{id:?} {size}");
            }
            let usual = Effect::new(id, Geometry::Rotary);
            assert!(own.iter().any(|one| one.effect == usual), "{id:?}");
            for one in own {
                assert_eq!(one.small().len(), one.sizes.len(), "{one:?}");
            }
        }
    }
}
