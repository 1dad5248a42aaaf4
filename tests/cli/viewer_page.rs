//! The motion viewer's page as its scripts see it.

use serde_json::Value;

/// What the page's scripts read.
pub fn page_data(page: &str) -> Value {
    let start = page.find(r#"id="motion-data">"#).unwrap() + r#"id="motion-data">"#.len();
    let end = start + page[start..].find("</script>").unwrap();
    serde_json::from_str(&page[start..end]).unwrap()
}
