//! Forces of inverse dynamics that stand for effects of the catalogue.

use anyhow::{Context, Result, bail};
use ema_sim::{Effect, EffectId};

use super::benchmark::Term;

/// The number of an effect whose key begins so, in any geometry.
fn number(effect: &Effect, start: &str) -> Result<f64> {
    let info = effect.id().info();
    let mut numbers = info.parameters.iter().zip(effect.values());
    let found = numbers.find(|(one, _)| one.key(effect.geometry()).starts_with(start));
    found.map(|(_, value)| *value).with_context(|| format!("{}: no number `{start}`", info.symbol))
}

/// The forces of a structure with these effects in it, at the shapes in which they were found.
///
/// # Errors
///
/// For an effect that inverse dynamics have no force for.
pub(super) fn of_effects(structure: &[Term], effects: &[&Effect]) -> Result<Vec<Term>> {
    let mut terms = structure.to_vec();
    for effect in effects {
        let has = |start: &str| number(effect, start).map(|value| value != 0.0);
        match effect.id() {
            EffectId::Stribeck => {
                terms.push(Term::Stribeck { speed: number(effect, "stribeck_speed")? });
            }
            EffectId::DirectionalFriction => {
                if has("viscous_asymmetry")? {
                    terms.push(Term::ViscousAsymmetry);
                }
                if has("coulomb_asymmetry")? {
                    terms.push(Term::Offset);
                }
            }
            EffectId::NonlinearViscous => terms.push(Term::Power {
                reference: number(effect, "reference_speed")?,
                exponent: number(effect, "viscous_exponent")?,
            }),
            EffectId::LoadFriction if has("load_share")? => terms.push(Term::LoadFriction),
            EffectId::Presliding => {
                terms.retain(|term| *term != Term::Dry);
                terms.push(Term::Bristle { deflection: number(effect, "presliding")? });
            }
            EffectId::Imbalance => {
                if has("imbalance_sin")? || has("imbalance_cos")? {
                    terms.extend(wave(1.0));
                }
                if has("spring")? {
                    terms.push(Term::Spring);
                }
            }
            EffectId::Cogging => {
                let per_turn = number(effect, "order").or_else(|_| number(effect, "wavenumber"))?;
                terms.extend(wave(per_turn));
            }
            EffectId::ControllerMismatch if has("delay")? => terms.push(Term::Slope),
            EffectId::Vibration => {
                let hz = number(effect, "frequency")?;
                terms.extend([Term::Sine { hz }, Term::Cosine { hz }]);
            }
            other => {
                let info = other.info();
                bail!("{} ({}) has no force in inverse dynamics", info.symbol, info.name);
            }
        }
    }
    Ok(terms)
}

fn wave(order: f64) -> [Term; 2] {
    [Term::SineOfAngle { order }, Term::CosineOfAngle { order }]
}

#[cfg(test)]
mod tests {
    use ema_sim::Geometry;

    use super::*;

    #[test]
    fn an_effect_without_a_force_in_the_identification_is_named() {
        let drag = Effect::new(EffectId::DirectionalFriction, Geometry::Linear)
            .with("viscous_asymmetry_n_s_per_m", -37.0)
            .unwrap();
        let structure = [Term::Mass, Term::Viscous, Term::Dry];
        let known = [Term::Mass, Term::Viscous, Term::Dry, Term::ViscousAsymmetry];
        assert_eq!(of_effects(&structure, &[&drag]).unwrap(), known);
        let weak = Effect::new(EffectId::MagnetLoss, Geometry::Linear);
        let said = of_effects(&structure, &[&drag, &weak]).unwrap_err().to_string();
        assert!(said.starts_with("E14 ("), "{said}");
    }

    #[test]
    fn keys_of_rotary_axes_are_found_too() {
        let cogging = Effect::new(EffectId::Cogging, Geometry::Rotary).with("order", 72.0).unwrap();
        let order = 72.0;
        let expected = [Term::Mass, Term::SineOfAngle { order }, Term::CosineOfAngle { order }];
        assert_eq!(of_effects(&[Term::Mass], &[&cogging]).unwrap(), expected);
    }
}
