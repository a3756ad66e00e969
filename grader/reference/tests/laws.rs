//! Each registered force has a law, and each law a registered force.

use reference::law;
use simulator::force::REGISTRY;

#[test]
fn every_registered_force_has_a_law_of_its_parameters() {
    for kind in REGISTRY {
        let tag = kind.schema.tag;
        let law = law::find(tag).unwrap_or_else(|| {
            panic!("{tag} has no law: state it in grader/reference/src/law, in LAWS of field.rs, pair.rs or stencil.rs")
        });
        let stated: Vec<&str> =
            kind.schema.parameters.iter().map(|parameter| parameter.name).collect();
        assert_eq!(law.parameters, stated, "{tag}");
        let stencil = kind.schema.stencil;
        assert_eq!((law.is_field(), law.size()), (stencil.is_field(), stencil.size()), "{tag}");
    }
}

#[test]
fn every_law_is_of_one_registered_force() {
    for law in law::all() {
        let kinds = REGISTRY.iter().filter(|kind| kind.schema.tag == law.tag).count();
        assert_eq!(kinds, 1, "{} has a law, and is no registered force", law.tag);
    }
}
