// A plot of lines as an SVG element that takes its colours from the page around it.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace defrec::cli {

struct PlotAxis {
    std::string label;
    double min = 0, max = 1;  // positive on a logarithmic axis
    bool logarithmic = false;
};

struct PlotLine {
    // A CSS class for its colour (`stroke` and `fill` are currentColor), and more of them.
    std::string css_class;
    std::vector<std::array<double, 2>> points;
    std::vector<std::string> titles;  // of the points, shown with markers; none: no markers
};

struct Plot {
    std::string title;  // for readers that do not see it
    PlotAxis x, y;
    std::vector<PlotLine> lines;  // clipped to the axes; later ones are in front
};

// Ascending positions of ticks within the axis: multiples of 1, 2 or 5 times a power of ten; on a
// logarithmic axis 1, 2 and 5 times powers of ten, or powers alone over more than three decades.
std::vector<double> ticks_of(const PlotAxis& axis);

std::string plot_svg(const Plot& plot);

}  // namespace defrec::cli
