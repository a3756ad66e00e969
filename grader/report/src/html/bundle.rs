//! All pages of a report in one file that can be sent.
//!
//! Each page is a `<template>`; the address names the one that is shown (`assets/bundle.js`). Scripts and styles are in the
//! file, and the policy names their hashes: no other script runs, as in pages with separate assets.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use picture::web;
use sha2::{Digest, Sha256};

use super::page::{Html, SCRIPTS};
use super::{ASSETS, GENERATOR};

/// Shows the page that the address names.
const BUNDLE: &str = include_str!("assets/bundle.js");

/// The pages among these files, by their paths, as one document.
pub fn bundle(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let asset = |name: &&str| ASSETS.iter().find(|(known, _)| known == name).map(|(_, text)| *text);
    let scripts: Vec<&str> = [BUNDLE].into_iter().chain(SCRIPTS.iter().filter_map(asset)).collect();
    let (_, style) = web::STYLE;
    let hash = |text: &str| format!("'sha256-{}'", STANDARD.encode(Sha256::digest(text)));
    let hashes: Vec<String> = scripts.iter().map(|script| hash(script)).collect();
    let policy = format!(
        "default-src 'none'; script-src {}; style-src {}; img-src data:; base-uri 'none'; form-action 'none'",
        hashes.join(" "),
        hash(style)
    );
    let mut html = Html::default();
    html.markup("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n")
        .open("meta", &[("http-equiv", "Content-Security-Policy"), ("content", &policy)])
        .markup("\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n")
        .open("meta", &[("name", "generator"), ("content", GENERATOR)])
        .markup("\n<meta name=\"color-scheme\" content=\"light dark\">\n<title>Report</title>\n")
        .markup("<link rel=\"icon\" href=\"data:,\">\n<style>");
    let mut document = html.into_string();
    document += style;
    document += "</style>\n</head>\n<body>\n";
    for (path, bytes) in files.iter().filter(|(path, _)| path.ends_with(".html")) {
        let page = String::from_utf8_lossy(bytes);
        let between = |start: &str, end: &str| {
            let (_, rest) = page.split_once(start)?;
            rest.rsplit_once(end).map(|(inner, _)| inner.to_owned())
        };
        let title = page.split_once("<title>").and_then(|(_, rest)| rest.split_once("</title>"));
        let mut template = Html::default();
        template.markup("<template data-page=\"").text(path).markup("\" data-title=\"");
        document += &template.into_string();
        // Escaped already.
        document += title.map_or("", |(title, _)| title);
        document += "\">";
        document += &between("<body>", "</body>").unwrap_or_default();
        document += "</template>\n";
    }
    for script in scripts {
        document += &format!("<script>{script}</script>\n");
    }
    (document + "</body>\n</html>\n").into_bytes()
}
