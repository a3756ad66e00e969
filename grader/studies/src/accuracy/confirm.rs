//! Confirmation of the order of each method by the scenes of a study.
//!
//! A scene *confirms* the order of a method if the errors of positions or of velocities have that slope, and no slope is
//! another one than theory says. Where a method is exact, or no range of time steps has a regular slope, the scene says
//! nothing. A method that no scene confirms is not known to have its order, however few orders differ.

use super::order::{Expected, Fit};
use super::{Curve, Order, Quantity, SceneStudy, Study};

/// Counts of the orders that theory predicts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Slopes that agree.
    pub agree: usize,
    /// Errors within rounding, which is never worse than theory.
    pub exact: usize,
    /// Orders that differ.
    pub differ: usize,
    /// Orders that could not be fitted.
    pub unknown: usize,
}

impl Agreement {
    /// The number of all orders that theory predicts.
    pub fn judged(self) -> usize {
        self.agree + self.exact + self.differ + self.unknown
    }

    fn add(&mut self, order: &Order) {
        match (order.agrees(), order.fit) {
            (Some(true), Fit::Exact) => self.exact += 1,
            (Some(true), _) => self.agree += 1,
            (Some(false), _) => self.differ += 1,
            (None, _) => self.unknown += 1,
        }
    }
}

/// The order of a method by the scenes.
#[derive(Debug, Clone, PartialEq)]
pub struct Confirmation {
    /// The method, as reports call it.
    pub label: String,
    /// Its order by theory.
    pub order: f64,
    /// Number of scenes with a prediction.
    pub scenes: usize,
    /// The scenes that confirm it, with the confirming slopes.
    pub confirmed: Vec<(String, Vec<f64>)>,
    /// Its predicted orders of positions, velocities and energies in all scenes.
    pub agreement: Agreement,
}

impl Confirmation {
    /// The least and the largest confirming slope; `None` if no scene confirms the order.
    pub fn range(&self) -> Option<[f64; 2]> {
        let slopes = || self.confirmed.iter().flat_map(|(_, slopes)| slopes).copied();
        let range = [slopes().fold(f64::INFINITY, f64::min), slopes().fold(0.0, f64::max)];
        (!self.confirmed.is_empty()).then_some(range)
    }
}

impl Study {
    /// Each method with an order: of the submission alone if there is one. A method whose order depends on the forces
    /// counts once for each order.
    pub fn confirmations(&self) -> Vec<Confirmation> {
        let foreign = self.submission.is_some();
        let mut confirmations: Vec<Confirmation> = Vec::new();
        for scene in self.scenes.iter().filter(|scene| scene.target.exceptions.is_some()) {
            let judged = |curve: &&Curve| curve.foreign == foreign && curve.is_offered();
            for curve in scene.curves.iter().filter(judged) {
                let Some(order) = curve.method.order else { continue };
                let label = curve.label();
                let known = confirmations.iter().position(|known| {
                    known.label == label && known.order.total_cmp(&order).is_eq()
                });
                let number = known.unwrap_or_else(|| {
                    confirmations.push(Confirmation {
                        label,
                        order,
                        scenes: 0,
                        confirmed: Vec::new(),
                        agreement: Agreement::default(),
                    });
                    confirmations.len() - 1
                });
                confirmations[number].add(scene, curve);
            }
        }
        confirmations
    }

    /// The methods whose order no scene confirms.
    pub fn unconfirmed(&self) -> Vec<Confirmation> {
        let all = self.confirmations().into_iter();
        all.filter(|confirmation| confirmation.confirmed.is_empty()).collect()
    }

    /// Agreement of all orders with theory: of the submission alone if there is one.
    pub fn agreement(&self) -> Agreement {
        let all = self.confirmations().into_iter().map(|confirmation| confirmation.agreement);
        all.fold(Agreement::default(), |sum, one| Agreement {
            agree: sum.agree + one.agree,
            exact: sum.exact + one.exact,
            differ: sum.differ + one.differ,
            unknown: sum.unknown + one.unknown,
        })
    }
}

impl Confirmation {
    fn add(&mut self, scene: &SceneStudy, curve: &Curve) {
        let orders = scene.orders(curve);
        orders.iter().for_each(|order| self.agreement.add(order));
        self.scenes += 1;
        let is_usual = |order: &&Order| {
            order.quantity != Quantity::Energy
                && order.expected == Some(Expected::Order(self.order))
        };
        let slope = |order: &Order| match order.fit {
            Fit::Slope { slope, .. } => Some(slope),
            _ => None,
        };
        let slopes: Vec<f64> = orders.iter().filter(is_usual).filter_map(slope).collect();
        let differs = orders.iter().any(|order| order.agrees() == Some(false));
        if !slopes.is_empty() && !differs {
            self.confirmed.push((scene.target.name.clone(), slopes));
        }
    }
}
