//! The page's parts put together.

use serde::Serialize;

use crate::report::svg::escape;

const TEMPLATE: &str = include_str!("viewer.html");
const STYLE: &str = include_str!("viewer.css");
/// In the order of their dependence.
const SCRIPTS: [&str; 6] = [
    include_str!("data.js"),
    include_str!("camera.js"),
    include_str!("scene.js"),
    include_str!("curves.js"),
    include_str!("music.js"),
    include_str!("player.js"),
];

/// The template with its places filled: `{{title}}`, `{{style}}`, `{{data}}`, `{{script}}`. What is
/// put in is not looked at again.
pub(super) fn page(title: &str, data: &impl Serialize) -> String {
    let mut page = String::with_capacity(1 << 16);
    let mut rest = TEMPLATE;
    while let Some((before, after)) = rest.split_once("{{") {
        page.push_str(before);
        let Some((place, behind)) = after.split_once("}}") else {
            break;
        };
        match place {
            "title" => page.push_str(&escape(title)),
            "style" => page.push_str(STYLE.trim_end()),
            "data" => page.push_str(&embedded_json(data)),
            _ => page.push_str(SCRIPTS.concat().trim_end()),
        }
        rest = behind;
    }
    page.push_str(rest);
    page
}

/// JSON that may stand inside a script element: no `<`, so no `</script>` and no `<!--` either.
fn embedded_json(data: &impl Serialize) -> String {
    // Strings, numbers and lists only: there is no key that could fail to be text.
    serde_json::to_string(data)
        .unwrap_or_default()
        .replace('<', "\\u003c")
}
