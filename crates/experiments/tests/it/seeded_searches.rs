//! Scalar searches by seed.

use experiments::{
    Contender, EvaluationRequest, EvaluationSetting, Protocol, SearchSpace, SearchView,
    SearchesOfSeed, SeededSearches,
};
use fdi_core::ema_sim::Imperfections;

const PAIR: [Contender; 2] = [Contender::Ei, Contender::TwoStepEi];
/// The design of a search for two faults, and four evaluations that the method chooses.
const DESIGN: usize = 10;
const EVALUATIONS: usize = 14;

fn request(seed: u64, jobs: usize) -> EvaluationRequest<'static> {
    EvaluationRequest {
        protocol: Protocol::Bench,
        setting: EvaluationSetting {
            imperfections: Imperfections::NONE,
            sensor_noise_a: 0.0,
            phase_rate_hz: 10_000.0,
            snapshots: 24,
            sparse_snapshots: 0,
        },
        conditions: 3,
        contenders: &PAIR,
        healthy: 0,
        largest_level: 1.0,
        max_evaluations: Some(EVALUATIONS),
        seed,
        jobs,
        clock: None,
    }
}

fn searches(request: &EvaluationRequest<'_>, view: SearchView) -> Vec<SearchesOfSeed> {
    let searches = SeededSearches::prepare(request).unwrap().seen(view);
    searches.run(&[0, 2], &[DESIGN]).unwrap()
}

#[test]
fn pairs_share_condition_and_design_and_repeat_at_any_number_of_threads() {
    let view = SearchView::of(SearchSpace::Linear { largest: 0.05 });
    let found = searches(&request(1, 1), view);
    for of_seed in &found {
        let [ei, two_step] = &of_seed.searches[..] else { panic!("two methods") };
        assert_eq!(ei.points[0], two_step.points[0], "the design is the same");
        assert_eq!(ei.points.last().unwrap().evaluations, EVALUATIONS);
        assert!(ei.points[1].discrepancy_a <= ei.points[0].discrepancy_a);
        let mean = ei.errors_percent.iter().sum::<f64>() / 2.0;
        assert!((ei.points[1].error_percent - mean).abs() < 1e-9 * mean);
    }
    assert_ne!(found[0].searches[0].levels, found[1].searches[0].levels);
    assert_eq!(found, searches(&request(1, 2), view));
    // the anti-test: another root seed is another condition
    assert_ne!(found, searches(&request(2, 1), view));
}

#[test]
fn a_space_decides_where_a_search_looks() {
    let request = request(1, 1);
    let largest = |space| {
        let found = searches(&request, SearchView::of(space));
        let levels = found.iter().flat_map(|of_seed| &of_seed.searches);
        levels.flat_map(|search| search.levels.clone()).fold(0.0, f64::max)
    };
    assert!(largest(SearchSpace::Linear { largest: 0.05 }) <= 0.05);
    assert_ne!(largest(SearchSpace::Linear { largest: 1.0 }), largest(SearchSpace::Cubic));
}

#[test]
fn the_discrepancy_is_least_at_the_truth_and_grows_with_the_way() {
    let request = request(1, 1);
    let rays = SeededSearches::prepare(&request).unwrap().rays(&[0.01, 0.5]).unwrap();
    assert_eq!(rays.len(), 3);
    for ray in rays {
        assert!(ray.at_truth_a < ray.along_a[0] && ray.along_a[0] < ray.along_a[1], "{ray:?}");
        assert!(ray.at_truth_a < ray.at_healthy_a);
    }
}
