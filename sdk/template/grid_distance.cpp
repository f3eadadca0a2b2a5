// See grid_distance.hpp. Two sweeps, down with the columns from left to right and up from right to
// left. No value waits for the one beside it, so that the compiler makes vectors of the loops:
// along a row values come from 1, 2 and 4 columns back, then, eight at a time, from the eight
// before.
#include "sdk/template/grid_distance.hpp"

namespace defrec {
namespace {

constexpr float kSide = 1, kCorner = 1.41421356f;

inline float lesser(float a, float b) { return b < a ? b : a; }

// One sweep. kWay: 1 from the left, -1 from the right; columns are counted from where it begins.
template <int kWay>
class Sweep {
  public:
    explicit Sweep(int columns) : columns_(columns) {}

    // last: the row that the sweep took before; nullptr: none.
    void take(float* row, const float* last) const {
        if (last != nullptr) step_from(last, row);
        float* const here = kWay > 0 ? row : row + columns_ - 1;
        step_along<1>(here);
        step_along<2>(here);
        step_along<4>(here);
        finish(here);
    }

  private:
    static constexpr int kBlock = 8;  // columns

    void step_from(const float* __restrict last, float* __restrict row) const {
        const int end = columns_ - 1;
        const auto corner = [last](int x) { return last[x] + kCorner; };
        const auto side = [last, row](int x) { return lesser(row[x], last[x] + kSide); };
        if (end == 0) {
            row[0] = side(0);
            return;
        }
        row[0] = lesser(side(0), corner(1));
        for (int x = 1; x < end; ++x)
            row[x] = lesser(side(x), lesser(corner(x - 1), corner(x + 1)));
        row[end] = lesser(side(end), corner(end - 1));
    }
    // From behind, so that none is changed before it has been read.
    template <int kBack>
    void step_along(float* here) const {
        for (int x = columns_ - 1; x >= kBack; --x)
            here[kWay * x] = lesser(here[kWay * x], here[kWay * (x - kBack)] + kBack * kSide);
    }
    void finish(float* here) const {
        int x = kBlock;
        for (; x + kBlock <= columns_; x += kBlock) {
            float before[kBlock];
            for (int k = 0; k < kBlock; ++k)
                before[k] = here[kWay * (x - kBlock + k)] + kBlock * kSide;
            for (int k = 0; k < kBlock; ++k)
                here[kWay * (x + k)] = lesser(here[kWay * (x + k)], before[k]);
        }
        for (; x < columns_; ++x)
            here[kWay * x] = lesser(here[kWay * x], here[kWay * (x - kBlock)] + kBlock * kSide);
    }

    int columns_;
};

}  // namespace

void spread_distance(std::span<float> distance, int columns, int rows) {
    const auto row = [&](int y) { return distance.data() + y * columns; };
    const Sweep<1> down(columns);
    for (int y = 0; y < rows; ++y) down.take(row(y), y > 0 ? row(y - 1) : nullptr);
    const Sweep<-1> up(columns);
    for (int y = rows - 1; y >= 0; --y) up.take(row(y), y < rows - 1 ? row(y + 1) : nullptr);
}

}  // namespace defrec
