// A page of plots and tables that needs no script and no network.
#pragma once

#include <string>

namespace defrec::cli {

// Up to and with <body>; more_style: CSS of its own. Colours of plot_svg's lines are the classes
// tracked, extrapolated, other, all, ideal and band; key is a list of what they mean.
std::string page_head(const std::string& title, const std::string& more_style = {});

// A card of the page. All three are HTML.
std::string page_section(const std::string& title, const std::string& hint,
                         const std::string& content);

}  // namespace defrec::cli
