//! Forces between two particles have formulas, from which findings name wrong terms.

use diagnosis::change::{Term, forms};
use simulator::force::REGISTRY;

#[test]
fn every_timeless_force_between_two_particles_has_forms() {
    for kind in REGISTRY {
        let schema = &kind.schema;
        if schema.stencil.size() != 2 || schema.depends_on().time {
            continue;
        }
        for Term { part, .. } in Term::of(schema) {
            let tag = schema.tag;
            let stated = forms::of(schema, part).is_some();
            assert!(
                stated,
                "{tag} has no forms: state them in grader/diagnosis/src/change/forms.rs"
            );
        }
    }
}
