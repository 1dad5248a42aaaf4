//! The kinds of models by their name in a config: the one place that lists them all.

use std::sync::{Arc, PoisonError, RwLock};

use super::{ModelKind, Paper};
#[cfg(feature = "papers")]
use super::{
    baselines::{linear_gaussian, retrieval, rotations::RotationBaseline},
    duan2022, harvey2020, li2023, moglow2020, pu2022,
    transition::Kind,
    valleperez2021,
};

/// Kinds that were [added](add) from outside.
static ADDED: RwLock<Vec<Arc<dyn ModelKind>>> = RwLock::new(Vec::new());

/// The kinds of this crate. The first is that of a config that names none.
fn built_in() -> Vec<Arc<dyn ModelKind>> {
    vec![
        #[cfg(feature = "papers")]
        Arc::new(Kind::Pan2021),
        #[cfg(feature = "papers")]
        Arc::new(Kind::Harvey2020),
        #[cfg(feature = "papers")]
        Arc::new(li2023::KIND),
        #[cfg(feature = "papers")]
        Arc::new(duan2022::KIND),
        #[cfg(feature = "papers")]
        Arc::new(harvey2020::ROTATIONS),
        #[cfg(feature = "papers")]
        Arc::new(pu2022::KIND),
        #[cfg(feature = "papers")]
        Arc::new(valleperez2021::KIND),
        #[cfg(feature = "papers")]
        Arc::new(moglow2020::KIND),
        #[cfg(feature = "papers")]
        Arc::new(Kind::Interpolation),
        #[cfg(feature = "papers")]
        Arc::new(Kind::LinearPositions),
        #[cfg(feature = "papers")]
        Arc::new(Kind::ZeroVelocity),
        #[cfg(feature = "papers")]
        Arc::new(RotationBaseline::Slerp),
        #[cfg(feature = "papers")]
        Arc::new(RotationBaseline::HeldPose),
        #[cfg(feature = "papers")]
        Arc::new(RotationBaseline::KeyPoseInterpolation),
        #[cfg(feature = "papers")]
        Arc::new(RotationBaseline::HeldSeed),
        #[cfg(feature = "papers")]
        Arc::new(retrieval::KIND),
        #[cfg(feature = "papers")]
        Arc::new(linear_gaussian::KIND),
    ]
}

/// Adds a kind of model to those that every command knows.
pub fn add(kind: impl ModelKind + 'static) {
    let mut added = ADDED.write().unwrap_or_else(PoisonError::into_inner);
    added.push(Arc::new(kind));
}

/// All kinds: those of this crate, then those added, in their order.
pub fn kinds() -> Vec<Arc<dyn ModelKind>> {
    let added = ADDED.read().unwrap_or_else(PoisonError::into_inner);
    let mut kinds = built_in();
    kinds.extend(added.iter().cloned());
    kinds
}

/// The papers of all kinds, each once, in their order.
pub fn papers() -> Vec<Paper> {
    let mut papers: Vec<Paper> = Vec::new();
    for paper in kinds().iter().flat_map(|kind| kind.papers()) {
        if papers.iter().all(|known| known.name != paper.name) {
            papers.push(paper);
        }
    }
    papers
}

/// The kind of this name.
pub fn find(name: &str) -> Option<Arc<dyn ModelKind>> {
    kinds().into_iter().find(|kind| kind.name() == name)
}
