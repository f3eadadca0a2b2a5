// A plot of lines as an SVG element.
#include "sdk/evaluation/score/plot.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/base/util/markup.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

// px of the SVG's own coordinates.
constexpr double kPlotWidth = 360, kPlotHeight = 320, kLeft = 56, kRight = 12, kTop = 10,
                 kBottom = 46;

double share_of(const PlotAxis& axis, double value) {
    return axis.logarithmic ? std::log(value / axis.min) / std::log(axis.max / axis.min)
                            : (value - axis.min) / (axis.max - axis.min);
}

// The shortest text with at most six decimals.
std::string tick_label(double value) {
    std::string text = format_fixed(value, 6);
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
    return text;
}

class Drawing {
  public:
    explicit Drawing(const Plot& plot) : plot_(plot) {}

    std::string svg() {
        out_ = "<svg viewBox=\"0 0 " + tick_label(kPlotWidth) + " " + tick_label(kPlotHeight) +
               "\" role=\"img\"><title>" + escaped(plot_.title) + "</title>";
        add_axes();
        // A nested SVG clips what it holds to its own rectangle.
        out_ += "<svg x=\"" + px(kLeft) + "\" y=\"" + px(kTop) + "\" width=\"" + px(width_) +
                "\" height=\"" + px(height_) + "\">";
        for (const PlotLine& line : plot_.lines) add_line(line);
        return out_ + "</svg></svg>\n";
    }

  private:
    static std::string px(double value) { return format_fixed(value, 1); }
    double x_of(double value) const { return width_ * share_of(plot_.x, value); }
    double y_of(double value) const { return height_ * (1 - share_of(plot_.y, value)); }

    void add_text(double x, double y, const char* anchor, const std::string& text,
                  const std::string& more = {}) {
        out_ += "<text x=\"" + px(x) + "\" y=\"" + px(y) + "\" text-anchor=\"" + anchor + "\"" +
                more + ">" + escaped(text) + "</text>";
    }

    void add_grid(double x1, double y1, double x2, double y2) {
        out_ += "<path class=\"grid\" d=\"M" + px(x1) + " " + px(y1) + "L" + px(x2) + " " + px(y2) +
                "\"/>";
    }

    void add_axes() {
        const double right = kLeft + width_, bottom = kTop + height_;
        for (const double tick : ticks_of(plot_.x)) {
            const double x = kLeft + x_of(tick);
            add_grid(x, kTop, x, bottom);
            add_text(x, bottom + 16, "middle", tick_label(tick));
        }
        for (const double tick : ticks_of(plot_.y)) {
            const double y = kTop + y_of(tick);
            add_grid(kLeft, y, right, y);
            add_text(kLeft - 6, y + 4, "end", tick_label(tick));
        }
        add_text(kLeft + width_ / 2, bottom + 36, "middle", plot_.x.label);
        add_text(-(kTop + height_ / 2), 14, "middle", plot_.y.label, " transform=\"rotate(-90)\"");
    }

    void add_line(const PlotLine& line) {
        out_ += "<g class=\"" + line.css_class + "\"><path d=\"";
        char command = 'M';
        for (const auto& [x, y] : line.points) {
            out_ += command;
            out_ += px(x_of(x)) + " " + px(y_of(y));
            command = 'L';
        }
        out_ += "\"/>";
        for (std::size_t i = 0; i < line.titles.size(); ++i) {
            const auto& [x, y] = line.points[i];
            out_ += "<circle cx=\"" + px(x_of(x)) + "\" cy=\"" + px(y_of(y)) +
                    "\" r=\"4\"><title>" + escaped(line.titles[i]) + "</title></circle>";
        }
        out_ += "</g>";
    }

    const Plot& plot_;
    const double width_ = kPlotWidth - kLeft - kRight, height_ = kPlotHeight - kTop - kBottom;
    std::string out_;
};

}  // namespace

std::vector<double> ticks_of(const PlotAxis& axis) {
    constexpr double kMost = 6, kSlack = 1e-9;
    std::vector<double> ticks;
    if (axis.logarithmic) {
        const bool powers_alone = axis.max > 1001 * axis.min;
        for (double power = std::pow(10, std::floor(std::log10(axis.min)));
             power <= axis.max * (1 + kSlack); power *= 10) {
            for (const double factor : {1.0, 2.0, 5.0}) {
                const double tick = factor * power;
                if (powers_alone && factor > 1) continue;
                if (tick >= axis.min * (1 - kSlack) && tick <= axis.max * (1 + kSlack))
                    ticks.push_back(tick);
            }
        }
        return ticks;
    }
    const double range = axis.max - axis.min;
    const double power = std::pow(10, std::floor(std::log10(range / kMost)));
    double step = 10 * power;
    for (const double factor : {5.0, 2.0, 1.0}) {
        if (range <= kMost * factor * power * (1 + kSlack)) step = factor * power;
    }
    const auto first = std::ceil(axis.min / step - kSlack);
    const auto last = std::floor(axis.max / step + kSlack);
    for (double i = first; i <= last; ++i) ticks.push_back(i * step);
    return ticks;
}

std::string plot_svg(const Plot& plot) { return Drawing(plot).svg(); }

}  // namespace defrec::cli
