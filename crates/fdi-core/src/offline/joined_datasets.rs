//! Datasets from several files, of one machine in one test.

use ema_sim::Parameter;

use crate::{offline::dataset::Dataset, simulation::experiment::Experiment};

/// A property in which two experiments differ, start angle apart.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentDifference {
    /// A parameter of the actuator.
    #[error("`{key}` of the model `{model}` is {found}, expected {expected}")]
    Parameter {
        /// Key of the parameter in a model file.
        key: &'static str,
        /// Name of the model that was found.
        model: String,
        /// Value found.
        found: f64,
        /// Value expected.
        expected: f64,
    },
    /// The shape of the back-EMF.
    #[error("`motor.back-emf-shape` of the model is not the one")]
    BackEmfShape,
    /// The name of the model or of the command.
    #[error("{of} is {found}, expected {expected}")]
    Name {
        /// Bearer of the name.
        of: &'static str,
        /// Name found.
        found: String,
        /// Name expected.
        expected: String,
    },
    /// A number of the test.
    #[error("{of} is {found}, expected {expected}")]
    Number {
        /// Quantity with its unit.
        of: &'static str,
        /// Value found.
        found: f64,
        /// Value expected.
        expected: f64,
    },
    /// The course of a command of one name.
    #[error("the command `{name}` is not the one")]
    Command {
        /// Name of both commands.
        name: String,
    },
    /// The faults looked for.
    #[error("the faults that the model lists are not the ones")]
    Faults,
    /// The definition of the envelope.
    #[error("the envelope is not the one")]
    Envelope,
}

/// Datasets that a bundle is learnt from, one file after another.
///
/// All are of one experiment. A design whose rotor starts anywhere has no start angle of its own:
/// that of the experiment is taken from the first file with a design that has one.
///
/// ```
/// use fdi_core::{Experiment, JoinedDatasets};
///
/// let mut joined = JoinedDatasets::default();
/// joined.add(Experiment::chirp(), Vec::new())?;
/// let refused = joined.add(Experiment::sine(), Vec::new()).unwrap_err();
/// assert_eq!(refused.to_string(), "the command is sine, expected chirp");
/// # Ok::<_, fdi_core::ExperimentDifference>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct JoinedDatasets {
    experiment: Option<Experiment>,
    datasets: Vec<Dataset>,
}

impl JoinedDatasets {
    /// Adds the datasets of a file.
    ///
    /// # Errors
    ///
    /// [`ExperimentDifference`] where the experiment is not that of the first file.
    pub fn add(
        &mut self,
        experiment: Experiment,
        datasets: Vec<Dataset>,
    ) -> Result<(), ExperimentDifference> {
        let has_start = |of: &[Dataset]| of.iter().any(|dataset| !dataset.design.is_turned());
        match &mut self.experiment {
            None => self.experiment = Some(experiment),
            Some(first) => {
                if let Some(difference) = first.difference(&experiment) {
                    return Err(difference);
                }
                if has_start(&datasets) && !has_start(&self.datasets) {
                    first.scenario.start_angle_rad = experiment.scenario.start_angle_rad;
                }
            }
        }
        self.datasets.extend(datasets);
        Ok(())
    }

    /// The experiment with all datasets; `None` where no file was added.
    pub fn into_parts(self) -> Option<(Experiment, Vec<Dataset>)> {
        Some((self.experiment?, self.datasets))
    }
}

impl Experiment {
    /// The first property in which another experiment differs from this one, start angle apart.
    pub fn difference(&self, found: &Self) -> Option<ExperimentDifference> {
        self.difference_of_machines(found).or_else(|| self.difference_of_tests(found))
    }

    fn difference_of_machines(&self, found: &Self) -> Option<ExperimentDifference> {
        for parameter in Parameter::ALL {
            let (is, expected) = (parameter.get(&found.actuator), parameter.get(&self.actuator));
            if is != expected {
                let (key, model) = (parameter.key(), found.model_name.clone());
                return Some(ExperimentDifference::Parameter { key, model, found: is, expected });
            }
        }
        let shape = |experiment: &Self| experiment.actuator.motor.back_emf_shape;
        (shape(found) != shape(self)).then_some(ExperimentDifference::BackEmfShape)
    }

    fn difference_of_tests(&self, found: &Self) -> Option<ExperimentDifference> {
        for (of, is, expected) in [
            ("the model", &found.model_name, &self.model_name),
            ("the command", &found.name, &self.name),
        ] {
            if is != expected {
                let (found, expected) = (is.clone(), expected.clone());
                return Some(ExperimentDifference::Name { of, found, expected });
            }
        }
        let numbers = |e: &Self| {
            [
                ("the load in N·m", e.scenario.load_n_m),
                ("the length in s", e.scenario.duration_s),
                ("the rate in Hz", e.filter.output_hz),
                ("the filter in Hz", e.filter.corner_hz),
            ]
        };
        for ((of, found), (_, expected)) in numbers(found).into_iter().zip(numbers(self)) {
            if found != expected {
                return Some(ExperimentDifference::Number { of, found, expected });
            }
        }
        if found.scenario.command != self.scenario.command {
            return Some(ExperimentDifference::Command { name: found.name.clone() });
        }
        if found.sought != self.sought {
            return Some(ExperimentDifference::Faults);
        }
        (found.envelope != self.envelope).then_some(ExperimentDifference::Envelope)
    }
}

#[cfg(test)]
mod tests {
    use ema_sim::Imperfections;

    use super::*;
    use crate::offline::dataset::ReferenceDesign;

    fn dataset(design: ReferenceDesign) -> Dataset {
        let imperfections = Imperfections::NONE;
        Dataset { design, seed: 0, imperfections, conditions: Vec::new(), signals_a: Vec::new() }
    }

    #[test]
    fn the_start_angle_is_that_of_a_design_that_has_one() {
        let starting_at = |start_angle_rad| {
            let mut experiment = Experiment::chirp();
            experiment.scenario.start_angle_rad = start_angle_rad;
            experiment
        };
        let mut joined = JoinedDatasets::default();
        joined.add(starting_at(0.0), vec![dataset(ReferenceDesign::Turned)]).unwrap();
        joined.add(starting_at(0.3), vec![dataset(ReferenceDesign::Incipient)]).unwrap();
        joined.add(starting_at(0.7), vec![dataset(ReferenceDesign::Sparse)]).unwrap();
        let (experiment, datasets) = joined.into_parts().unwrap();
        assert_eq!((experiment.scenario.start_angle_rad, datasets.len()), (0.3, 3));
    }

    #[test]
    fn each_difference_is_told() {
        type Change = fn(&mut Experiment);
        let told = |change: Change| {
            let mut found = Experiment::chirp();
            change(&mut found);
            Experiment::chirp().difference(&found).map(|difference| difference.to_string())
        };
        assert_eq!(told(|e| e.scenario.start_angle_rad = 1.0), None);
        let cases: [(Change, &str); 5] = [
            (|e| e.scenario.load_n_m = 0.25, "the load in N·m is 0.25, expected 0.5"),
            (|e| e.model_name = "x".into(), "the model is x, expected ema-48"),
            (
                |e| e.scenario.command = Experiment::sine().scenario.command,
                "the command `chirp` is not the one",
            ),
            (|e| e.sought[0] = false, "the faults that the model lists are not the ones"),
            (|e| e.envelope = ema_sim::Envelope::QAxis, "the envelope is not the one"),
        ];
        for (change, expected) in cases {
            assert_eq!(told(change).as_deref(), Some(expected));
        }
        let mut other = Experiment::chirp();
        other.actuator.motor.resistance_ohm *= 2.0;
        let difference = Experiment::chirp().difference(&other).unwrap().to_string();
        assert!(difference.starts_with("`motor.resistance-ohm` of the model `ema-48` is "));
    }
}
