// See lm_plan.hpp.
#include "backends/cuda/lm_plan.hpp"

namespace defrec::cuda {

LmPlan::LmPlan(const LmTemplate& surface, const LmLists& lists, uint32_t most_blocks) {
    const auto nodes = uint32_t(surface.nodes.size());
    rows = std::max((nodes + most_blocks - 1) / most_blocks, 1u);
    uint32_t first = 0;
    do {
        shares.push_back({first, std::min(first + rows, nodes), 0, 0, 0, 0, 0, 0, 0, 0});
        first += rows;
    } while (first < nodes);
    add_rows(surface.pattern);
    add_connections(lists);
    add_items(lists);
    add_sums(lists);
}

void LmPlan::add_rows(const BlockPattern& pattern) {
    for (LmShare& share : shares) {
        share.first_place = uint32_t(places.size());
        for (uint32_t i = share.first_node; i < share.last_node; ++i) {
            row_places.push_back(uint32_t(places.size()));
            for (size_t b = pattern.row_start(i); b < pattern.row_start(i + 1); ++b)
                if (const auto column = uint32_t(pattern.column(b)); column != i) places.push_back({i - share.first_node, column});
        }
        share.last_place = uint32_t(places.size());
        most_places = std::max(most_places, share.last_place - share.first_place);
    }
    row_places.push_back(uint32_t(places.size()));
}

uint32_t LmPlan::place(uint32_t row, uint32_t column) const {
    const auto first = places.begin() + row_places[row], last = places.begin() + row_places[row + 1];
    const auto at = std::lower_bound(first, last, column, [](const LmPlace& p, uint32_t c) { return p.column < c; });
    return uint32_t(at - places.begin());
}

void LmPlan::add_connections(const LmLists& lists) {
    std::vector<std::vector<uint32_t>> of_node(row_places.size() - 1);
    for (uint32_t e = 0; e < lists.edges.size(); ++e) {
        of_node[lists.edges[e].a].push_back(e);
        of_node[lists.edges[e].b].push_back(e);
    }
    for (LmShare& share : shares) {
        share.first_connection = uint32_t(connections.size());
        for (uint32_t i = share.first_node; i < share.last_node; ++i)
            for (const uint32_t e : of_node[i]) {
                const LmEdge& edge = lists.edges[e];
                const bool forwards = edge.a == i;
                const float sign = forwards ? 1.0f : -1.0f;
                const uint32_t j = forwards ? edge.b : edge.a;
                connections.push_back({{sign * edge.rest[0], sign * edge.rest[1], sign * edge.rest[2], edge.rest[3]}, i, j,
                                       place(i, j) - share.first_place, edge.share});
            }
        share.last_connection = uint32_t(connections.size());
    }
}

// An item goes to every block that owns one of its control points; the first's counts it.
void LmPlan::add_items(const LmLists& lists) {
    std::vector<std::vector<uint32_t>> of_block(shares.size());
    for (uint32_t item = 0; item < lists.item_nodes.size(); ++item) {
        const auto& node = lists.item_nodes[item];
        of_block[owner(node[0])].push_back(item);
        for (size_t k = 1; k < DEFREC_SKIN_NODES; ++k) {
            std::vector<uint32_t>& there = of_block[owner(node[k])];
            if (lists.weight(item, k) == 0) continue;
            if (there.empty() || (there.back() & ~kUncounted) != item) there.push_back(item | kUncounted);
        }
    }
    for (size_t b = 0; b < shares.size(); ++b) {
        shares[b].first_item = uint32_t(items.size());
        items.insert(items.end(), of_block[b].begin(), of_block[b].end());
        shares[b].last_item = uint32_t(items.size());
    }
}

void LmPlan::add_sums(const LmLists& lists) {
    for (LmShare& share : shares) {
        const uint32_t longest = std::max(share.last_item - share.first_item, share.last_connection - share.first_connection);
        share.first_chunk = uint32_t(chunks.size());
        share.chunks = (longest + kLmChunk - 1) / kLmChunk;
        for (uint32_t chunk = 0; chunk < share.chunks; ++chunk) add_chunk(lists, share, chunk);
    }
    chunks.push_back(uint32_t(sums.size()));
}

void LmPlan::add_chunk(const LmLists& lists, const LmShare& share, uint32_t chunk) {
    const uint32_t count = share.last_node - share.first_node, from = chunk * kLmChunk;
    std::vector<std::pair<uint32_t, uint32_t>> found;  // target, term
    const uint32_t last_item = std::min(share.first_item + from + kLmChunk, share.last_item);
    for (uint32_t at = share.first_item + from; at < last_item; ++at) {
        const uint32_t item = items[at] & ~kUncounted, slot = at - share.first_item - from;
        const auto& node = lists.item_nodes[item];
        for (uint32_t k = 0; k < DEFREC_SKIN_NODES; ++k)
            for (uint32_t l = 0; l < DEFREC_SKIN_NODES; ++l) {
                const auto i = uint32_t(node[k]), j = uint32_t(node[l]);
                if (i < share.first_node || i >= share.last_node || lists.weight(item, k) == 0 || lists.weight(item, l) == 0) continue;
                found.push_back({i == j ? i - share.first_node : count + place(i, j) - share.first_place, slot << 4 | k << 2 | l});
            }
    }
    std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });

    chunks.push_back(uint32_t(sums.size()));
    const auto slot_of = [&](uint32_t connection) {  // clamped to the chunk
        return uint16_t(std::min(std::max(connection, share.first_connection + from) - share.first_connection - from, kLmChunk));
    };
    uint32_t connection = share.first_connection;
    size_t next = 0;
    for (uint32_t row = 0; row < count; ++row) {
        const uint32_t first = connection;
        while (connection < share.last_connection && connections[connection].i == share.first_node + row) ++connection;
        sums.push_back({0, 0, row, slot_of(first), slot_of(connection)});
    }
    const size_t beside = sums.size();
    while (next < found.size()) {
        const uint32_t target = found[next].first, first = uint32_t(terms.size());
        while (next < found.size() && found[next].first == target) terms.push_back(found[next++].second);
        const auto last = uint32_t(terms.size());
        if (target < count) {
            LmSum& own = sums[beside - count + target];
            own.first_term = first;
            own.last_term = last;
        } else {
            sums.push_back({first, last, target, 0, 0});
        }
    }
    // Longest first: what a warp does last is short.
    std::stable_sort(sums.begin() + std::ptrdiff_t(beside), sums.end(),
                     [](const LmSum& a, const LmSum& b) { return a.last_term - a.first_term > b.last_term - b.first_term; });
}

}  // namespace defrec::cuda
