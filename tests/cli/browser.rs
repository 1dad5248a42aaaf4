//! Pages in a headless browser, for tests that need one where there is one.

use std::path::{Path, PathBuf};
use std::time::Duration;

use assert_cmd::Command;
use tempfile::TempDir;

const NAMES: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];

/// Chromium or Chrome: `CHROMIUM`, or what is on the path. Says so when there is none.
pub fn browser() -> Option<PathBuf> {
    let named = std::env::var_os("CHROMIUM").map(PathBuf::from);
    let folders: Vec<PathBuf> = std::env::var_os("PATH")
        .map(|path| std::env::split_paths(&path).collect())
        .unwrap_or_default();
    let on_path = || {
        let places = folders
            .iter()
            .flat_map(|folder| NAMES.map(|name| folder.join(name)));
        places.into_iter().find(|place| place.is_file())
    };
    let found = named.or_else(on_path);
    if found.is_none() {
        eprintln!("skipped: no Chromium on the path; set CHROMIUM to its file");
    }
    found
}

/// A page after it has run for a while.
pub struct Loaded {
    /// The document as it is then, HTML.
    pub document: String,
    /// What the page's console and the browser say.
    pub log: String,
}

/// Opens a file, with `hash` behind it in the address, and lets it run until it is `ready`.
///
/// A browser's clock runs ahead of a busy machine and may reach its end before the first repaint:
/// a page that is not ready is loaded again for twice as long, and the last one is given back.
pub fn load(browser: &Path, page: &Path, hash: &str, ready: impl Fn(&Loaded) -> bool) -> Loaded {
    let mut loaded = load_for(browser, page, hash, 1000);
    for milliseconds in [2000, 4000, 8000, 16_000] {
        if ready(&loaded) {
            break;
        }
        loaded = load_for(browser, page, hash, milliseconds);
    }
    loaded
}

fn load_for(browser: &Path, page: &Path, hash: &str, milliseconds: u32) -> Loaded {
    let profile = TempDir::new().unwrap();
    let output = Command::new(browser)
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-dev-shm-usage",
        ])
        .args([
            "--enable-logging=stderr",
            "--window-size=1280,800",
            "--dump-dom",
        ])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("--virtual-time-budget={milliseconds}"))
        .arg(format!("file://{}{hash}", page.display()))
        .timeout(Duration::from_secs(120))
        .output()
        .unwrap();
    Loaded {
        document: String::from_utf8_lossy(&output.stdout).into_owned(),
        log: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

impl Loaded {
    /// Whether the page has drawn a frame, or an error ended it.
    pub fn has_drawn(&self) -> bool {
        ["data-frame", "data-error"].map(|name| self.attribute(name).is_some()) != [false; 2]
    }

    /// Value of an attribute of the document's root element.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        let root = &self.document[self.document.find("<html")?..];
        let root = &root[..root.find('>')?];
        let value = &root[root.find(&format!(" {name}=\""))? + name.len() + 3..];
        value.split('"').next()
    }

    /// Lines that the page wrote to its console, errors among them.
    pub fn console(&self) -> Vec<&str> {
        self.log
            .lines()
            .filter(|line| line.contains("CONSOLE"))
            .collect()
    }
}
