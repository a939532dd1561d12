//! The catalogue of effects, as it is listed.

use std::path::Path;

use fdi_core::{
    Schema,
    ema_sim::EffectId,
    report::{CatalogueEffect, EffectCatalogue},
};

use crate::commands::{answer, output, whole};

fn listed(arguments: &[&str]) -> String {
    whole(&output(Path::new("."), &[&["effects"], arguments].concat()))
}

#[test]
fn effects_are_listed_with_what_each_is_confounded_with() {
    insta::assert_snapshot!(listed(&[]));
}

#[test]
fn effects_asked_for_are_shown_with_equation_units_bounds_and_defaults() {
    insta::assert_snapshot!(listed(&["E01", "E11", "--linear"]));
}

#[test]
fn json_and_csv_hold_every_number_of_every_effect() {
    let json = output(Path::new("."), &["effects", "--output-format", "json"]);
    let catalogue: EffectCatalogue = answer(&json, Schema::Effects);
    let of = |id: &EffectId| {
        let found = catalogue.effects.iter().find(|effect| effect.id == id.info().symbol);
        found.unwrap_or_else(|| panic!("no {id:?}"))
    };
    assert_eq!(catalogue.effects.len(), EffectId::ALL.len());
    let mut numbers = 0;
    for id in &EffectId::ALL {
        let effect: &CatalogueEffect = of(id);
        assert_eq!(effect.parameters.len(), id.info().parameters.len(), "{id:?}");
        numbers += effect.parameters.len();
    }
    let csv = output(Path::new("."), &["effects", "--output-format", "csv"]);
    let lines = String::from_utf8(csv.stdout).unwrap();
    assert_eq!(lines.lines().count(), 1 + numbers);
    assert!(
        lines.lines().any(|line| line.contains("eddy_n_m_s_per_rad,N·m·s/rad,0,eddy_n_s_per_m"))
    );
}

#[test]
fn an_effect_that_is_none_is_refused() {
    let said = listed(&["E99"]);
    assert!(said.starts_with("exit 2"), "{said}");
    assert!(said.contains("`E99`: no effect of the catalogue, expected one of E01 to E25, or U"));
}
