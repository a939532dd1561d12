//! Residual that nothing in the catalogue explains, as a curve that a model file can hold.

use ema_sim::{
    Coordinate, Curve, CurveKind, Effect, Geometry,
    model_file::{Annotation, EffectBlock, MachineModel},
};

use crate::{
    curve::ResidualCurve,
    explained::{Explained, Verdict},
};

/// Fewest samples behind a point of the curve.
const LEAST_SAMPLES: usize = 10;
/// Share of the residual's variance below which a curve is not worth having.
const LEAST_SHARE: f64 = 0.05;

/// The curve that explains most of what is left where the verdict is `unknown`, as a torque or
/// force against positive motion: what the drive makes of the mean residual over the coordinate.
///
/// That is what it takes where the loops follow slowly; far above their bandwidth the drive does
/// not answer to a torque, and the curve is too small. None where the residual follows nothing that
/// a curve can be over, as the drive, the load or chance.
pub(crate) fn unexplained_block(
    explained: &Explained,
    model: &MachineModel,
) -> Option<EffectBlock> {
    if explained.verdict != Verdict::Unknown {
        return None;
    }
    let geometry = model.geometry();
    let over = |one: &ResidualCurve| {
        let found = Coordinate::ALL.into_iter().find(|(name, _)| *name == one.coordinate);
        // over the angle a curve repeats itself, which that of a carriage does not
        found
            .map(|(_, over)| over)
            .filter(|over| geometry == Geometry::Rotary || *over != Coordinate::MotorAngle)
    };
    let curves = explained.curves.iter().filter(|one| one.share_after >= LEAST_SHARE);
    let curves = curves.filter_map(|one| Some((one, over(one)?)));
    let (best, over) = curves.max_by(|(a, _), (b, _)| a.share_after.total_cmp(&b.share_after))?;
    let curve = Curve::new(over, CurveKind::Torque, points(best, over, model)?).ok()?;
    let mut block = EffectBlock::from(Effect::tabulated(curve, geometry));
    block.name = Some(format!("unknown, over the {}", best.coordinate));
    block.annotations.push(("status".to_owned(), Annotation::Text("unknown".to_owned())));
    let share = Annotation::Number(best.share_after);
    let evidence = Annotation::Table(vec![("share-of-residual-variance".to_owned(), share)]);
    block.annotations.push(("evidence".to_owned(), evidence));
    Some(block)
}

/// Coordinate and torque or force.
fn points(best: &ResidualCurve, over: Coordinate, model: &MachineModel) -> Option<Vec<[f64; 2]>> {
    let machine = model.kind();
    if !machine.controls_its_drive() {
        return None;
    }
    let constant = machine.torque_per_drive();
    let periods = machine.pole_pairs().unwrap_or(1);
    let periods = if over == Coordinate::MotorAngle { periods } else { 1 };
    let period = core::f64::consts::TAU / f64::from(periods);
    let bins = || best.bins.iter().filter(|bin| bin.samples >= LEAST_SAMPLES);
    let at = |turn: u32| {
        let shift = f64::from(turn) * period;
        bins().map(move |bin| [bin.centre + shift, constant * bin.mean_after])
    };
    Some((0..periods).flat_map(at).collect())
}
