// See map_distance.hpp.
#include "sdk/tracking/map_distance.hpp"

#include <algorithm>

namespace defrec {
namespace {

// Calls visit(part, its first cell) for each part in order.
template <class Visit>
void for_each_part(const TemplateData& data, Visit&& visit) {
    size_t first = data.grid.vertex.size();
    for (const GrownPart& part : data.parts) {
        visit(part, first);
        first += part.vertex.size();
    }
}

// Takes what is known of a part's vertices, spreads it over the part, and gives it back.
void spread_over_part(const GrownPart& part, size_t first, std::span<const uint32_t> cell,
                      std::span<float> distance) {
    const std::span<float> here = distance.subspan(first, part.vertex.size());
    for (size_t i = 0; i < here.size(); ++i)
        if (part.vertex[i] >= 0)
            here[i] = std::min(here[i], distance[cell[static_cast<size_t>(part.vertex[i])]]);
    spread_distance(here, part.columns, part.rows);
    for (size_t i = 0; i < here.size(); ++i)
        if (part.vertex[i] >= 0) {
            float& elsewhere = distance[cell[static_cast<size_t>(part.vertex[i])]];
            elsewhere = std::min(elsewhere, here[i]);
        }
}

}  // namespace

size_t number_cells(const TemplateData& data, std::vector<uint32_t>& cell) {
    for (size_t i = 0; i < data.grid.vertex.size(); ++i)
        if (data.grid.vertex[i] >= 0)
            cell[static_cast<size_t>(data.grid.vertex[i])] = static_cast<uint32_t>(i);
    size_t cells = data.grid.vertex.size();
    for_each_part(data, [&](const GrownPart& part, size_t first) {
        for (size_t i = 0; i < part.vertex.size(); ++i)
            if (part.vertex[i] >= static_cast<int64_t>(part.before.vertices))
                cell[static_cast<size_t>(part.vertex[i])] = static_cast<uint32_t>(first + i);
        cells = first + part.vertex.size();
    });
    return cells;
}

namespace {

void spread_over_piece(const TemplateData& data, std::span<const uint32_t> cell,
                       std::span<float> distance) {
    const auto spread_first_view = [&] {
        spread_distance(distance.first(data.grid.vertex.size()), data.grid.columns, data.grid.rows);
    };
    spread_first_view();
    if (data.parts.empty()) return;
    for_each_part(data, [&](const GrownPart& part, size_t first) {
        spread_over_part(part, first, cell, distance);
    });
    // Back again: an earlier part may be nearer to what a later one shows.
    size_t first = distance.size();
    for (auto part = data.parts.rbegin(); part != data.parts.rend(); ++part) {
        first -= part->vertex.size();
        spread_over_part(*part, first, cell, distance);
    }
    spread_first_view();
}

}  // namespace

void spread_over_map(const TemplateData& data, std::span<const uint32_t> cell,
                     std::span<float> distance) {
    const size_t pieces = data.pieces();
    if (pieces == 1) {
        spread_over_piece(data, cell, distance);
        return;
    }
    // From a piece's vertices to its own alone.
    std::vector<float> known(distance.size());
    for (size_t piece = 0; piece < pieces; ++piece) {
        std::fill(known.begin(), known.end(), 1e6f);
        const auto for_own = [&](auto&& visit) {
            for (size_t i = 0; i < data.vertices.size(); ++i)
                if (data.piece_of(data.vertices[i]) == piece) visit(cell[i]);
        };
        for_own([&](uint32_t own) { known[own] = distance[own]; });
        spread_over_piece(data, cell, known);
        for_own([&](uint32_t own) { distance[own] = known[own]; });
    }
}

}  // namespace defrec
