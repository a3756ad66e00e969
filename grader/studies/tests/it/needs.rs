//! Scenes use only the resources they need.

use test_support::suite;

use simulator::solver::linear::LinearSolver;
use studies::needs::{self, Excess};

#[test]
fn shipped_scenes_use_no_excess_and_match_the_general_path() {
    let cases = suite().cases;
    assert!(cases.len() > 100);
    for case in &cases {
        let need = needs::measure(&case.id, &case.scene).unwrap();
        assert_eq!(need.excess, [], "{}", case.id);
        // The course's criterion for two correct simulators.
        assert!(need.difference < 1e-10, "{}: {:e}", case.id, need.difference);
    }
}

#[test]
fn excess_cost_is_detected() {
    let cases = suite().cases;
    let found = |wanted: Excess, of: &dyn Fn(&scene::Scene) -> Vec<Excess>| {
        cases.iter().any(|case| of(&case.scene).contains(&wanted))
    };
    let sparse = |scene: &scene::Scene| {
        needs::excess(scene, &needs::cost(scene, LinearSolver::Sparse).unwrap())
    };
    assert!(found(Excess::SparseForSmall, &sparse));
    // The general path uses more than the scene needs.
    let general = |scene: &scene::Scene| {
        let cost = needs::cost(&needs::general(scene), LinearSolver::Auto);
        cost.map_or(Vec::new(), |cost| needs::excess(scene, &cost))
    };
    for wanted in
        [Excess::MoreCoordinates, Excess::ForceNotMentioned, Excess::FactorsWithoutCoupling]
    {
        assert!(found(wanted, &general), "{wanted:?}");
    }
    // The scene of an explicit method, stepped by an implicit one.
    let implicit = |scene: &scene::Scene| {
        let integrator = simulator::vocabulary().integrator("implicit-euler").unwrap();
        let mut other = scene.clone();
        other.integrator_options = scene::schema::IntegratorOptions::defaults(integrator);
        other.integrator = integrator;
        needs::cost(&other, LinearSolver::Auto)
            .map_or(Vec::new(), |cost| needs::excess(scene, &cost))
    };
    assert!(found(Excess::MatrixOfExplicit, &implicit));
}
