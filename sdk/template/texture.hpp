// How well a window of an image can be found again.
#pragma once
#include <cmath>

namespace defrec {

// Smaller eigenvalue of the structure tensor over 2 radius + 1 pixels each way round (cx, cy), per
// pixel of the window, squared gray levels (Shi and Tomasi 1994). gray(x, y): of a pixel that is
// step wide; the window needs such a pixel more on each side.
template <class Gray>
double texture(const Gray& gray, int cx, int cy, int radius, int step = 1) {
    const int reach = radius * step;
    double xx = 0, xy = 0, yy = 0;
    for (int y = cy - reach; y <= cy + reach; y += step)
        for (int x = cx - reach; x <= cx + reach; x += step) {
            const double gx = 0.5 * (gray(x + step, y) - gray(x - step, y));
            const double gy = 0.5 * (gray(x, y + step) - gray(x, y - step));
            xx += gx * gx;
            xy += gx * gy;
            yy += gy * gy;
        }
    const double mean = 0.5 * (xx + yy), spread = std::hypot(0.5 * (xx - yy), xy);
    return (mean - spread) / ((2 * radius + 1) * (2 * radius + 1));
}

}  // namespace defrec
