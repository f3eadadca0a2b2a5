// A page of plots and tables: what stands before its content.
#include "sdk/evaluation/score/plot_page.hpp"

#include "sdk/base/util/markup.hpp"

namespace defrec::cli {
namespace {

constexpr char kHead[] = R"(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; style-src 'unsafe-inline'; img-src data:">
<title>)";
constexpr char kStyle[] = R"(</title>
<style>
:root {
  color-scheme: light dark;
  --paper: #f6f7f9; --card: #ffffff; --ink: #17202c; --muted: #5b6675; --line: #dfe3e9;
  --tracked: #2563eb; --extrapolated: #d97706; --other: #16a05e;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #10151c; --card: #18202a; --ink: #e8edf4; --muted: #9aa7b8; --line: #2b3645;
    --tracked: #7fb0ff; --extrapolated: #fbbf24; --other: #4ade80;
  }
}
body {
  max-width: 1200px; margin: 0 auto; padding: 24px 20px; background: var(--paper);
  color: var(--ink); font: 15px/1.5 system-ui, "Segoe UI", Roboto, sans-serif;
}
h1 { margin: 0; font-size: 26px; overflow-wrap: anywhere; }
h2 { margin: 0 0 4px; font-size: 18px; }
.from, .hint { margin: 4px 0 12px; color: var(--muted); overflow-wrap: anywhere; }
header { margin-bottom: 16px; }
main { display: grid; grid-template-columns: repeat(auto-fit, minmax(330px, 1fr)); gap: 16px; }
section {
  padding: 16px 18px; background: var(--card); border: 1px solid var(--line); border-radius: 12px;
}
.wide { grid-column: 1 / -1; overflow-x: auto; }
pre { margin: 0; font: 12.5px/1.5 ui-monospace, monospace; }
svg { display: block; width: 100%; font-size: 12px; fill: var(--muted); }
svg path { fill: none; stroke: currentColor; stroke-width: 2; }
svg circle { fill: currentColor; }
svg .grid { stroke: var(--line); stroke-width: 1; }
.tracked { color: var(--tracked); }
.extrapolated { color: var(--extrapolated); }
.other { color: var(--other); }
.all { color: var(--ink); }
.ideal { color: var(--muted); }
.ideal path { stroke-width: 1; stroke-dasharray: 4 4; }
.band { color: var(--muted); opacity: 0.35; }
.band path { stroke-width: 8; }
.verdict { margin: 4px 0 12px; font-size: 19px; font-weight: 600; }
.notes { margin: 0 0 12px; padding: 0; list-style: none; }
.notes li { margin: 0 0 8px; overflow-wrap: anywhere; }
.doubt { padding: 12px 14px; border-radius: 8px; background: #b91c1c; color: #fff; }
.sentence { display: inline-block; max-width: calc(100vw - 80px); white-space: pre-wrap; }
.key { margin: 0; padding: 0; list-style: none; }
.key li { display: inline-block; margin-right: 16px; }
.key li::before { content: "\25CF\2002"; }
)";
constexpr char kBody[] = R"(</style>
</head>
<body>
)";

}  // namespace

std::string page_head(const std::string& title, const std::string& more_style) {
    return kHead + escaped(title) + kStyle + more_style + kBody;
}

std::string page_section(const std::string& title, const std::string& hint,
                         const std::string& content) {
    return "<section><h2>" + title + "</h2><p class=\"hint\">" + hint + "</p>\n" + content +
           "</section>\n";
}

}  // namespace defrec::cli
