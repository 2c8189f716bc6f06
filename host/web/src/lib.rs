//! The view as a web page.
