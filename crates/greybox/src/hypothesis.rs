//! The catalogue as questions: which sizes of which effect, with which shapes.

pub(crate) use ema_sim::MachineScales as Scales;
use ema_sim::{Effect, EffectId, EffectParameter, Geometry, Quantity, Role, ShapeScales};

use crate::{plausible::Plausible, structure::Number};

/// Sizes of one effect that belong together, and its shapes worth trying.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Family {
    pub(crate) id: EffectId,
    /// Places of the sizes.
    pub(crate) sizes: Vec<usize>,
    /// The effect with each shape; sizes zero.
    pub(crate) shapes: Vec<Effect>,
    /// Shapes among which these were chosen: what chance had to choose from.
    pub(crate) looked_at: f64,
}

impl Family {
    /// Shapes among which those tried were chosen; one where all were tried.
    pub(crate) fn screened(&self) -> f64 {
        let tried = self.shapes.len() as f64;
        if self.looked_at > tried { self.looked_at } else { 1.0 }
    }

    /// Numbers of shape that a fit may move.
    pub(crate) fn free_shapes(&self) -> Vec<usize> {
        let parameters = self.id.info().parameters.iter().enumerate();
        let moves = |parameter: &EffectParameter| match parameter.role() {
            Role::Shape(multiples) => multiples.len() > 1,
            Role::Place | Role::Frequency => true,
            _ => false,
        };
        parameters.filter(|(_, p)| moves(p)).map(|(place, _)| place).collect()
    }
}

/// Sizes of an effect that are asked for together; each group is a question of its own. A curve is
/// measured and not asked for.
fn groups(id: EffectId) -> Vec<Vec<usize>> {
    if id.info().takes_curve { Vec::new() } else { id.info().size_groups() }
}

/// Where shapes are to be looked for: the recordings' speeds, places, orders and frequencies.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Leads {
    /// Orders of the motor's angle that the residual shows, best first, for a torque, for a
    /// ripple of torque and for an error of the position.
    pub(crate) orders: Vec<f64>,
    pub(crate) ripple_orders: Vec<f64>,
    pub(crate) error_orders: Vec<f64>,
    pub(crate) orders_looked_at: f64,
    pub(crate) frequencies_hz: Vec<f64>,
    pub(crate) frequencies_looked_at: f64,
    /// Centre and width of a region of the travel.
    pub(crate) regions: Vec<(f64, f64)>,
    pub(crate) regions_looked_at: f64,
    /// Typical speed.
    pub(crate) speed: f64,
    /// Inertia or mass of the machine.
    pub(crate) inertia: f64,
}

/// All questions that the catalogue has for a machine.
pub(crate) fn families(geometry: Geometry, leads: &Leads, is_axis: bool) -> Vec<Family> {
    let mut families = Vec::new();
    for id in EffectId::ALL {
        let plain = Effect::new(id, geometry);
        let (shapes, looked_at) = shapes(&plain, leads, is_axis);
        for sizes in groups(id) {
            if shapes.is_empty() {
                continue;
            }
            families.push(Family { id, sizes, shapes: shapes.clone(), looked_at });
        }
    }
    families
}

/// The shapes of an effect that are tried, and how many were looked at to find them.
fn shapes(plain: &Effect, leads: &Leads, is_axis: bool) -> (Vec<Effect>, f64) {
    let id = plain.id();
    let with = |places: &[(usize, f64)]| {
        let mut effect = plain.clone();
        for (place, value) in places {
            let parameter = &id.info().parameters[*place];
            let (least, most) = parameter.bounds();
            effect.set(parameter.key(plain.geometry()), value.clamp(least, most)).ok()?;
        }
        Some(effect)
    };
    let parameters = id.info().parameters;
    let place_of = |role| parameters.iter().position(|parameter| parameter.role() == role);
    if let Some(place) = place_of(Role::Order) {
        // by what its sizes are: a torque, an error of the position, a share of the torque
        let size = parameters.iter().find(|parameter| parameter.role() == Role::Amplitude);
        let orders = match size.map(EffectParameter::quantity) {
            Some(Quantity::Torque) => &leads.orders,
            Some(Quantity::Angle) => &leads.error_orders,
            _ => &leads.ripple_orders,
        };
        let found = orders.iter().filter_map(|n| with(&[(place, *n)]));
        return (found.collect(), leads.orders_looked_at);
    }
    if let Some(place) = place_of(Role::Frequency) {
        let found = leads.frequencies_hz.iter().filter_map(|f| with(&[(place, *f)]));
        return (found.collect(), leads.frequencies_looked_at);
    }
    if let Some(place) = place_of(Role::Place) {
        let found = leads.regions.iter().filter_map(|(c, w)| with(&[(place, *c), (place + 1, *w)]));
        return (found.collect(), leads.regions_looked_at);
    }
    let scales = ShapeScales {
        speed: leads.speed.max(1e-9),
        undivided_inertia: is_axis.then_some(leads.inertia),
    };
    let mut found = vec![plain.clone()];
    for parameter in parameters {
        let key = parameter.key(plain.geometry());
        let tried = parameter.trials(plain.geometry(), &scales);
        if !tried.is_empty() {
            let each = |effect: &Effect| {
                let effect = effect.clone();
                tried
                    .iter()
                    .filter_map(move |v| effect.clone().with(key, *v).ok())
                    .collect::<Vec<_>>()
            };
            found = found.iter().flat_map(each).collect();
        }
    }
    let looked_at = found.len() as f64;
    (found, looked_at)
}

/// A first size, small against what the machine does: it is scaled to what the noise lets one see.
pub(crate) fn first_size(parameter: &EffectParameter, scales: &Scales) -> f64 {
    parameter.typical_size(scales)
}

/// Effects whose action is not in proportion to their size.
pub(crate) fn is_nonlinear_in_size(id: EffectId) -> bool {
    id.info().nonlinear_in_size
}

/// Multiples of the first size at which an effect is tried. What a softness does is not in
/// proportion to it: it is looked for at several, each taken as it is.
pub(crate) fn multiples(id: EffectId) -> &'static [f64] {
    if is_nonlinear_in_size(id) { &[1.0, 0.2, 0.04] } else { &[1.0] }
}

/// Effects whose sizes are others in each recording: a vibration has no phase of its own.
pub(crate) fn differs_by_record(id: EffectId) -> bool {
    id.info().differs_by_recording
}

/// Places of numbers with the steps of a fit: sizes by the size tried, shapes by a share of
/// their value.
pub(crate) fn numbers(
    effect: &Effect,
    sizes: &[(usize, f64)],
    shapes: &[usize],
    plausible: &Plausible,
) -> Vec<Number> {
    let travel = plausible.travel;
    let size = |&(place, step): &(usize, f64)| {
        let most = plausible.most(&effect.id().info().parameters[place]);
        let is_nonlinear = is_nonlinear_in_size(effect.id());
        Number {
            place,
            in_record: None,
            step: if is_nonlinear { 0.1 * step } else { step },
            least: if is_nonlinear { 0.01 * step } else { -most },
            most,
        }
    };
    let shape = |&place: &usize| {
        let value = effect.values()[place];
        match effect.id().info().parameters[place].role() {
            Role::Place => {
                let half = 0.15 * travel;
                Number {
                    place,
                    in_record: None,
                    step: 0.01 * travel,
                    least: value - half,
                    most: value + half,
                }
            }
            Role::Frequency => {
                Number { place, in_record: None, step: 1e-3, least: value - 0.2, most: value + 0.2 }
            }
            _ => Number {
                place,
                in_record: None,
                step: 0.03 * value,
                least: 0.2 * value,
                most: 5.0 * value,
            },
        }
    };
    sizes.iter().map(size).chain(shapes.iter().map(shape)).collect()
}
