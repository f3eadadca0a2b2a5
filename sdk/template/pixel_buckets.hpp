// Points of an image, sorted so that those near a pixel are found at once.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace defrec {

struct PixelPoint {
    int32_t index;  // of what lies there
    double u, v;    // px
};

class PixelBuckets {
  public:
    // side: of a bucket, px; about the distance that is looked for.
    PixelBuckets(const std::vector<PixelPoint>& points, double side) : side_(side) {
        for (const PixelPoint& point : points) sorted_.push_back({bucket(point.u, point.v), point});
        std::stable_sort(sorted_.begin(), sorted_.end(),
                         [](const Entry& a, const Entry& b) { return a.bucket < b.bucket; });
    }

    // Calls visit(point, squared distance) for every point at most that far from the pixel, bucket
    // by bucket.
    template <class Visit>
    void near(double u, double v, double distance, Visit&& visit) const {
        const int64_t reach = static_cast<int64_t>(std::ceil(distance / side_));
        const int64_t x = column(u), y = column(v);
        for (int64_t row = y - reach; row <= y + reach; ++row)
            for (auto entry = first_of(key(x - reach, row)),
                      end = first_of(key(x + reach + 1, row));
                 entry != end; ++entry) {
                const double du = entry->point.u - u, dv = entry->point.v - v;
                if (du * du + dv * dv <= distance * distance)
                    visit(entry->point, du * du + dv * dv);
            }
    }

    // The nearest point at most that far away; nullptr: there is none.
    const PixelPoint* nearest(double u, double v, double distance) const {
        return nearest(u, v, distance, [](const PixelPoint&) { return true; });
    }
    // Likewise, of those that belong.
    template <class Belongs>
    const PixelPoint* nearest(double u, double v, double distance, Belongs&& belongs) const {
        const PixelPoint* best = nullptr;
        double least = 0;
        near(u, v, distance, [&](const PixelPoint& point, double squared) {
            if ((best != nullptr && squared >= least) || !belongs(point)) return;
            best = &point;
            least = squared;
        });
        return best;
    }

  private:
    struct Entry {
        int64_t bucket;
        PixelPoint point;
    };
    static constexpr int64_t kRow = int64_t{1} << 31;  // more than buckets in a row
    static int64_t key(int64_t x, int64_t y) { return y * kRow + x; }
    int64_t column(double position) const {
        return static_cast<int64_t>(std::floor(std::clamp(position, -1e6, 1e6) / side_));
    }
    int64_t bucket(double u, double v) const { return key(column(u), column(v)); }
    std::vector<Entry>::const_iterator first_of(int64_t wanted) const {
        return std::lower_bound(sorted_.begin(), sorted_.end(), wanted,
                                [](const Entry& e, int64_t at) { return e.bucket < at; });
    }

    double side_;
    std::vector<Entry> sorted_;
};

}  // namespace defrec
