//! Truth of a case, as JSON, and its seal.

use std::fmt::Write;

use sha2::{Digest, Sha256};

use crate::{class::Class, machine::Machine};

/// One hidden effect.
#[derive(Clone, Debug, PartialEq)]
pub struct HiddenTruth {
    /// Catalogue symbol, or `X1` to `X6`.
    pub symbol: &'static str,
    /// Size, in the unit of its form.
    pub size: f64,
    /// The form with its numbers.
    pub form: String,
    /// Energy of its difference signal over the noise in the training recordings that faults,
    /// nuisance parameters and the other hidden effect cannot imitate.
    pub lambda: f64,
    /// True where that is 30 or more.
    pub visible: bool,
    /// Share of the signal that is its own, `√(λ/whole)`.
    pub own_share: f64,
    /// Energy by slopes over faults and nuisance parameters alone.
    pub lambda_by_slopes: f64,
    /// Size over the one that is found in half of all cases, `√(λ/15)`.
    pub severity: f64,
}

/// With what the effect is tied.
#[derive(Clone, Debug, PartialEq)]
pub struct TieTruth {
    /// Catalogue symbols.
    pub partners: Vec<&'static str>,
    /// Energy over the noise that tells them apart; below 4.
    pub lambda: f64,
}

/// Truth of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Class of the case.
    pub class: Class,
    /// The machine.
    pub machine: Machine,
    /// The seed.
    pub seed: u64,
    /// Effects that are hidden.
    pub hidden: Vec<HiddenTruth>,
    /// Lambda of all that is hidden together.
    pub lambda: f64,
    /// Rms over the noise in the held-out recording after faults and nuisance parameters are
    /// fitted.
    pub excess: f64,
    /// By how much what is hidden shifts fault levels that are fitted without it, by slopes.
    pub shifts: Vec<(&'static str, f64)>,
    /// Fault levels.
    pub faults: Vec<(&'static str, f64)>,
    /// Relative changes of numbers within the tolerance of the model file.
    pub nuisances: Vec<(&'static str, f64)>,
    /// Kind and rms of the noise, A.
    pub noise: (&'static str, f64),
    /// Commands: training, training, hold-out.
    pub moves: Vec<&'static str>,
    /// A tie by construction.
    pub tie: Option<TieTruth>,
}

impl Truth {
    /// Nothing hidden.
    pub(crate) fn plain(class: Class, machine: Machine, seed: u64) -> Self {
        Self {
            class,
            machine,
            seed,
            hidden: Vec::new(),
            lambda: 0.0,
            excess: 1.0,
            shifts: Vec::new(),
            faults: Vec::new(),
            nuisances: Vec::new(),
            noise: ("", 0.0),
            moves: Vec::new(),
            tie: None,
        }
    }

    /// The level of a fault.
    pub fn fault(&self, id: &str) -> Option<f64> {
        self.faults.iter().find(|(known, _)| *known == id).map(|(_, level)| *level)
    }

    /// One line of JSON.
    pub(crate) fn to_json(&self) -> String {
        let quoted = |all: &[&str]| {
            let all: Vec<String> = all.iter().map(|text| format!("{text:?}")).collect();
            format!("[{}]", all.join(","))
        };
        let pairs = |all: &[(&str, f64)]| {
            let all: Vec<String> =
                all.iter().map(|(key, v)| format!("{key:?}:{}", number(*v))).collect();
            format!("{{{}}}", all.join(","))
        };
        let hidden: Vec<String> = self.hidden.iter().map(HiddenTruth::to_json).collect();
        let mut text = String::new();
        let _ = write!(
            text,
            "{{\"class\":{:?},\"machine\":{:?},\"seed\":{},\"hidden\":[{}],\"lambda\":{},\
             \"excess\":{},\"shifts\":{},\"faults\":{},\"rough\":{},\"noise\":{:?},\"noise_a\":{},\"moves\":{}",
            self.class.name(),
            self.machine.name(),
            self.seed,
            hidden.join(","),
            number(self.lambda),
            number(self.excess),
            pairs(&self.shifts),
            pairs(&self.faults),
            pairs(&self.nuisances),
            self.noise.0,
            number(self.noise.1),
            quoted(&self.moves),
        );
        if let Some(tie) = &self.tie {
            let (partners, lambda) = (quoted(&tie.partners), number(tie.lambda));
            let _ = write!(text, ",\"tied_with\":{partners},\"tie_lambda\":{lambda}");
        }
        text.push('}');
        text
    }
}

impl HiddenTruth {
    fn to_json(&self) -> String {
        format!(
            "{{\"id\":{:?},\"size\":{},\"form\":{:?},\"lambda\":{},\
             \"lambda_by_slopes\":{},\"visible\":{},\"own_share\":{},\"severity\":{}}}",
            self.symbol,
            number(self.size),
            self.form,
            number(self.lambda),
            number(self.lambda_by_slopes),
            self.visible,
            number(self.own_share),
            number(self.severity),
        )
    }
}

/// A number as JSON has it.
fn number(value: f64) -> String {
    if value.is_finite() { format!("{value:?}") } else { "null".to_owned() }
}

/// SHA-256 in hexadecimal digits.
pub fn sha256_hex(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(64);
    for byte in Sha256::digest(bytes) {
        let _ = write!(text, "{byte:02x}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_sha256_of_abc() {
        // FIPS 180-2, appendix B.1
        let want = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256_hex(b"abc"), want);
    }
}
