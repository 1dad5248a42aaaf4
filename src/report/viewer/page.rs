//! The page's parts put together.

use std::borrow::Cow;

use serde::Serialize;

use crate::report::svg::escape;

const TEMPLATE: &str = include_str!("viewer.html");
pub(in crate::report) const STYLE: &str = include_str!("viewer.css");
/// What draws a scene, and plays its song: in the order of their dependence.
pub(in crate::report) const SCENE_SCRIPTS: [&str; 4] = [
    include_str!("data.js"),
    include_str!("camera.js"),
    include_str!("scene.js"),
    include_str!("music.js"),
];
/// What is round it.
const SCRIPTS: [&str; 4] = [
    include_str!("curves.js"),
    include_str!("hand_on.js"),
    include_str!("dropped.js"),
    include_str!("player.js"),
];

/// The viewer's page: `{{title}}`, `{{style}}`, `{{data}}`, `{{script}}`.
pub(super) fn page(title: &str, data: &impl Serialize) -> String {
    let (data, script) = (
        embedded_json(data),
        [SCENE_SCRIPTS.concat(), SCRIPTS.concat()].concat(),
    );
    filled(TEMPLATE, |place| match place {
        "title" => escape(title).into(),
        "style" => STYLE.trim_end().into(),
        "data" => data.as_str().into(),
        _ => script.trim_end().into(),
    })
}

/// A template with its places, such as `{{title}}`, filled. What is put in is not looked at again.
pub(in crate::report) fn filled<'c>(
    template: &str,
    content: impl Fn(&str) -> Cow<'c, str>,
) -> String {
    let mut page = String::with_capacity(1 << 16);
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        page.push_str(before);
        let Some((place, behind)) = after.split_once("}}") else {
            break;
        };
        page.push_str(&content(place));
        rest = behind;
    }
    page.push_str(rest);
    page
}

/// JSON that may stand inside a script element: no `<`, so no `</script>` and no `<!--` either.
pub(in crate::report) fn embedded_json(data: &impl Serialize) -> String {
    // Strings, numbers and lists only: there is no key that could fail to be text.
    serde_json::to_string(data)
        .unwrap_or_default()
        .replace('<', "\\u003c")
}
