//! Pairs of effects that recordings without the right excitation cannot tell apart.

use crate::{
    chance::Chance,
    command::Move,
    effect::{self, Form, Hidden, Wave},
    machine::Machine,
};

/// Pairs tied by construction, with the recordings that tie them: directional dry friction and an
/// offset of the current sensor (there and back without a rest), cogging and current ripple (one
/// way at a steady speed), friction of the load and a weak magnet (one way against a load), a
/// weak magnet and a gain error (slowly there and back against a load).
pub const TIES: [[&str; 2]; 4] = [["E03", "E19"], ["E11", "E12"], ["E04", "E14"], ["E14", "E19"]];

/// A tie as drawn.
#[derive(Clone, Debug)]
pub(crate) struct Tie {
    pub(crate) truth: Hidden,
    pub(crate) most: f64,
    pub(crate) partner: &'static str,
    /// Effects whose signatures span what the partner can do.
    pub(crate) partners: Vec<Hidden>,
    pub(crate) kind: Move,
    pub(crate) loaded: bool,
}

fn member(symbol: &'static str, form: Form, size: f64) -> Hidden {
    Hidden { symbol, form, size }
}

impl Tie {
    /// Draws the pair of a number, and which of it is true.
    pub(crate) fn draw(machine: Machine, number: usize, chance: &mut Chance) -> Self {
        // the actuator's faults of the winding imitate gains
        let pairs: &[usize] = if machine == Machine::Servo { &[0, 1, 2, 3] } else { &[0, 1] };
        let pair = pairs[number % pairs.len()];
        let first = chance.chance(0.5);
        let of = |a: Hidden, b: Vec<Hidden>, most: f64, kind, loaded| Self {
            partner: b[0].symbol,
            truth: a,
            most,
            partners: b,
            kind,
            loaded,
        };
        match (pair, first) {
            (0, true) => of(
                member("E03", Form::UnequalDry, 0.0),
                vec![member("E19", Form::ReadingOffset, 1e-3)],
                0.012,
                Move::Triangle,
                false,
            ),
            (0, false) => of(
                member("E19", Form::ReadingOffset, 0.0),
                vec![member("E03", Form::UnequalDry, 1e-4)],
                0.1,
                Move::Triangle,
                false,
            ),
            (1, _) => Self::periodic(machine, first, chance),
            (2, true) => of(
                member("E04", Form::RubbingLoad { corner: 1e-3 }, 0.0),
                vec![member("E14", Form::WeakMagnet, 1e-3)],
                0.25,
                Move::OneWay,
                true,
            ),
            (2, false) => of(
                member("E14", Form::WeakMagnet, 0.0),
                vec![member("E04", Form::RubbingLoad { corner: 1e-3 }, 1e-3)],
                0.25,
                Move::OneWay,
                true,
            ),
            (_, true) => of(
                member("E14", Form::WeakMagnet, 0.0),
                vec![member("E19", Form::ReadingGain, 1e-3)],
                0.25,
                Move::Triangle,
                true,
            ),
            (_, false) => of(
                member("E19", Form::ReadingGain, 0.0),
                vec![member("E14", Form::WeakMagnet, 1e-3)],
                0.2,
                Move::Triangle,
                true,
            ),
        }
    }

    /// Cogging and current ripple of one order, whose phase the other is free in.
    fn periodic(machine: Machine, cogging: bool, chance: &mut Chance) -> Self {
        let order = if machine == Machine::Servo { chance.one_of(&[12.0, 24.0]) } else { 24.0 };
        let wave = effect::wave(order, 0.0, chance);
        let modulation_phase = chance.angle();
        let quarter = core::f64::consts::FRAC_PI_2;
        let two = |form: fn(Wave, f64) -> Form, symbol, size| {
            [0.0, quarter]
                .map(|phase| {
                    let wave = Wave { phase, ..Wave { order, ..wave } };
                    member(symbol, form(wave, modulation_phase), size)
                })
                .to_vec()
        };
        let cogs = |wave, modulation_phase| Form::Cogs { wave, modulation_phase };
        let ripple = |wave, _| Form::TorqueWave(wave);
        let (truth, partners, most) = if cogging {
            let truth = member("E11", cogs(wave, modulation_phase), 0.0);
            (truth, two(ripple, "E12", 1e-3), 0.015)
        } else {
            (member("E12", ripple(wave, 0.0), 0.0), two(cogs, "E11", 1e-5), 0.3)
        };
        let partner = partners[0].symbol;
        Self { truth, most, partner, partners, kind: Move::OneWay, loaded: false }
    }
}
