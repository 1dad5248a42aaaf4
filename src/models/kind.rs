//! A kind of model, which a config's `model.kind` names, and the papers that it belongs to.

use std::marker::PhantomData;

use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::Table;

use super::settings::ModelSettings;
use crate::data::DataConfig;
use crate::evaluation::{EvaluationOptions, Protocol};
use crate::report::demo::OpenDemo;
use crate::report::figures::DrawFigures;

/// A paper that models belong to.
#[derive(Debug, Clone, Copy)]
pub struct Paper {
    /// Name of its folders, such as `pan2021`.
    pub name: &'static str,
    /// The numbers that it prints, TOML: see [`crate::evaluation::PrintedTables`].
    pub printed: &'static str,
    /// What draws its figures.
    pub figures: Option<DrawFigures>,
    /// What shows its model without data.
    pub demo: Option<OpenDemo>,
    /// How its tables score a model, for data that is read like this. The first protocol also
    /// scores a training on validation clips.
    pub protocols: fn(&DataConfig, &EvaluationOptions) -> Vec<Box<dyn Protocol>>,
    /// Further ways to score one, which no table has: only where they are asked for by name.
    pub by_name: fn(&DataConfig, &EvaluationOptions) -> Vec<Box<dyn Protocol>>,
}

impl Paper {
    /// Without figures, a demo and further ways to score.
    pub const fn new(
        name: &'static str,
        printed: &'static str,
        protocols: fn(&DataConfig, &EvaluationOptions) -> Vec<Box<dyn Protocol>>,
    ) -> Self {
        Self {
            name,
            printed,
            figures: None,
            demo: None,
            protocols,
            by_name: |_, _| Vec::new(),
        }
    }
}

/// A kind of model: what a config's `model.kind` names.
pub trait ModelKind: Send + Sync {
    /// Its name in a config.
    fn name(&self) -> &str;

    /// The name of an experiment that gives none.
    fn default_name(&self) -> &str {
        self.name()
    }

    /// The papers whose tables and figures its models may stand in, by a config's `paper`: the
    /// first where a config names none.
    fn papers(&self) -> Vec<Paper>;

    /// The tables of a config that are its own, `[model]` among them, with the default of every
    /// key.
    fn defaults(&self) -> Table;

    /// Reads these tables.
    ///
    /// # Errors
    /// A key that it does not know, or a value of the wrong kind.
    fn read(&self, tables: Table) -> Result<Box<dyn ModelSettings>, toml::de::Error>;

    /// Gives keys of earlier versions their present names, in one layer of a config.
    fn rename_former_keys(&self, _layer: &mut Table) {}
}

/// The kind of the settings `S`, a line of the registry.
pub struct KindOf<S> {
    name: &'static str,
    default_name: &'static str,
    papers: fn() -> Vec<Paper>,
    settings: PhantomData<fn() -> S>,
}

impl<S> KindOf<S> {
    /// Named so in a config; of these papers, see [`ModelKind::papers`].
    pub const fn new(name: &'static str, papers: fn() -> Vec<Paper>) -> Self {
        Self {
            name,
            default_name: name,
            papers,
            settings: PhantomData,
        }
    }

    /// With another name for an experiment that gives none.
    pub const fn called(self, default_name: &'static str) -> Self {
        Self {
            default_name,
            ..self
        }
    }
}

impl<S: ModelSettings + Default + Serialize + DeserializeOwned> ModelKind for KindOf<S> {
    fn name(&self) -> &str {
        self.name
    }

    fn default_name(&self) -> &str {
        self.default_name
    }

    fn papers(&self) -> Vec<Paper> {
        (self.papers)()
    }

    fn defaults(&self) -> Table {
        // The defaults hold numbers that TOML has, which a test proves of every kind.
        Table::try_from(S::default()).unwrap_or_default()
    }

    fn read(&self, tables: Table) -> Result<Box<dyn ModelSettings>, toml::de::Error> {
        Ok(Box::new(tables.try_into::<S>()?))
    }
}
