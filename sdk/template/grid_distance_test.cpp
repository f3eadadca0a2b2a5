// spread_distance against a search for the shortest way over sides and corners.
#include "sdk/template/grid_distance.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <queue>
#include <random>
#include <utility>
#include <vector>

using namespace defrec;

namespace {

std::vector<float> shortest_ways(std::vector<float> distance, int columns, int rows) {
    using Reached = std::pair<float, int>;  // distance, cell
    std::priority_queue<Reached, std::vector<Reached>, std::greater<>> reached;
    for (int cell = 0; cell < columns * rows; ++cell)
        reached.push({distance[static_cast<size_t>(cell)], cell});
    while (!reached.empty()) {
        const auto [far, cell] = reached.top();
        reached.pop();
        if (far > distance[static_cast<size_t>(cell)]) continue;
        const int x = cell % columns, y = cell / columns;
        for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) {
                if (x + dx < 0 || x + dx >= columns || y + dy < 0 || y + dy >= rows) continue;
                const int next = cell + dy * columns + dx;
                const auto longer = far + static_cast<float>(std::sqrt(dx * dx + dy * dy));
                if (longer >= distance[static_cast<size_t>(next)]) continue;
                distance[static_cast<size_t>(next)] = longer;
                reached.push({longer, next});
            }
    }
    return distance;
}

}  // namespace

TEST_CASE("distances on a grid are those of the shortest ways over sides and corners") {
    std::mt19937 random(1);
    for (const int rows : {1, 2, 3, 20})
        for (const int columns : {1, 2, 3, 5, 8, 9, 15, 16, 17, 31, 40})
            for (const unsigned one_of : {1u, 3u, 40u, 1000u}) {
                std::vector<float> distance(static_cast<size_t>(columns) * rows);
                for (float& value : distance)
                    value = random() % one_of == 0 ? static_cast<float>(random() % 4) : 1e6f;
                const std::vector<float> expected = shortest_ways(distance, columns, rows);
                spread_distance(distance, columns, rows);
                float worst = 0;
                for (size_t i = 0; i < distance.size(); ++i)
                    worst = std::max(worst, std::abs(distance[i] - expected[i]));
                CAPTURE(columns);
                CAPTURE(rows);
                // A distance of 1e6 is 1/16 fine.
                CHECK(worst <= (expected[0] > 1e5f ? 2.f : 1e-4f));
            }
}
