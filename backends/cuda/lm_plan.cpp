// See lm_plan.hpp.
#include "backends/cuda/lm_plan.hpp"

namespace defrec::cuda {
namespace {

// Control points that share a block of the matrix with those from first to last - 1: these, then
// the others in order.
std::vector<uint32_t> known_to(const BlockPattern& pattern, uint32_t first, uint32_t last) {
    std::vector<uint32_t> known;
    for (uint32_t i = first; i < last; ++i) known.push_back(i);
    std::vector<uint32_t> others;
    for (size_t b = pattern.row_start(first); first < last && b < pattern.row_start(last); ++b)
        if (const auto column = uint32_t(pattern.column(b)); column < first || column >= last)
            others.push_back(column);
    std::sort(others.begin(), others.end());
    known.insert(known.end(), others.begin(), std::unique(others.begin(), others.end()));
    return known;
}

// Where a control point is among those that a block knows, own of which are its own, from first on.
uint32_t place_among(std::span<const uint32_t> known, uint32_t first, uint32_t own, uint32_t node) {
    if (node >= first && node < first + own) return node - first;
    const auto others = known.begin() + own;
    return uint32_t(std::lower_bound(others, known.end(), node) - known.begin());
}

uint32_t rows_of_block(uint32_t nodes, uint32_t max_blocks) {
    return std::max((nodes + max_blocks - 1) / max_blocks, 1u);
}

}  // namespace

LmRowPlan::LmRowPlan(const BlockPattern& pattern, uint32_t nodes, uint32_t max_blocks)
    : rows(rows_of_block(nodes, max_blocks)) {
    uint32_t first = 0;
    do {
        const uint32_t last = std::min(first + rows, nodes), before = uint32_t(known.size()),
                       places_before = uint32_t(places.size());
        const std::vector<uint32_t> own = known_to(pattern, first, last);
        known.insert(known.end(), own.begin(), own.end());
        for (uint32_t i = first; i < last; ++i)
            for (size_t b = pattern.row_start(i); b < pattern.row_start(i + 1); ++b)
                if (const auto column = uint32_t(pattern.column(b)); column != i)
                    places.push_back({i - first, place_among(own, first, last - first, column)});
        const auto places_now = uint32_t(places.size());
        shares.push_back({first, last, before, uint32_t(known.size()), places_before, places_now});
        max_known = std::max(max_known, uint32_t(own.size()));
        max_places = std::max(max_places, places_now - places_before);
        first = last;
    } while (first < nodes);
}

LmPlan::LmPlan(const LmTemplate& surface, const LmLists& lists, uint32_t max_blocks) {
    const auto nodes = uint32_t(surface.nodes.size());
    rows = rows_of_block(nodes, max_blocks);
    uint32_t first = 0;
    do {
        LmShare& share = shares.emplace_back();
        share.first_node = first;
        share.last_node = first = std::min(first + rows, nodes);
    } while (first < nodes);

    Edges of_node(nodes);
    for (uint32_t e = 0; e < lists.edges.size(); ++e) {
        of_node[lists.edges[e].a].push_back(e);
        of_node[lists.edges[e].b].push_back(e);
    }
    const auto of_block = items_of_blocks(lists);
    for (size_t b = 0; b < shares.size(); ++b) {
        LmShare& share = shares[b];
        add_rows(surface.pattern, share);
        add_connections(lists, of_node, share);
        add_items(lists, of_block[b], share);
        const uint32_t longest = std::max(share.last_item - share.first_item,
                                          share.last_connection - share.first_connection);
        share.first_chunk = uint32_t(chunks.size());
        share.chunks = (longest + kLmChunk - 1) / kLmChunk;
        for (uint32_t chunk = 0; chunk < share.chunks; ++chunk) add_chunk(lists, share, chunk);
    }
    row_places.push_back(uint32_t(places.size()));
}

// An item goes to every block that owns one of its control points; the first's counts it.
std::vector<std::vector<uint32_t>> LmPlan::items_of_blocks(const LmLists& lists) const {
    std::vector<std::vector<uint32_t>> of_block(shares.size());
    for (uint32_t item = 0; item < lists.item_nodes.size(); ++item) {
        const auto& node = lists.item_nodes[item];
        of_block[uint32_t(node[0]) / rows].push_back(item);
        for (size_t k = 1; k < DEFREC_BLEND_NODES; ++k) {
            std::vector<uint32_t>& there = of_block[uint32_t(node[k]) / rows];
            if (lists.weight(item, k) == 0 ||
                (!there.empty() && (there.back() & ~kLmUncounted) == item))
                continue;
            there.push_back(item | kLmUncounted);
        }
    }
    return of_block;
}

void LmPlan::add_rows(const BlockPattern& pattern, LmShare& share) {
    share.first_known = uint32_t(known.size());
    const std::vector<uint32_t> own = known_to(pattern, share.first_node, share.last_node);
    known.insert(known.end(), own.begin(), own.end());
    share.last_known = uint32_t(known.size());
    max_known = std::max(max_known, uint32_t(own.size()));

    share.first_place = uint32_t(places.size());
    for (uint32_t i = share.first_node; i < share.last_node; ++i) {
        row_places.push_back(uint32_t(places.size()));
        for (size_t b = pattern.row_start(i); b < pattern.row_start(i + 1); ++b)
            if (const auto column = uint32_t(pattern.column(b)); column != i)
                places.push_back({i - share.first_node, known_as(share, column)});
    }
    share.last_place = uint32_t(places.size());
    max_places = std::max(max_places, share.last_place - share.first_place);
}

uint32_t LmPlan::known_as(const LmShare& share, uint32_t node) const {
    return place_among(
        std::span(known).subspan(share.first_known, share.last_known - share.first_known),
        share.first_node, share.last_node - share.first_node, node);
}

// The place of two control points that the block knows, the first its own.
uint32_t LmPlan::place(const LmShare& share, uint32_t row, uint32_t column) const {
    uint32_t at = row_places[share.first_node + row];
    while (places[at].column != column) ++at;
    return at - share.first_place;
}

void LmPlan::add_connections(const LmLists& lists, const Edges& of_node, LmShare& share) {
    share.first_connection = uint32_t(connections.size());
    for (uint32_t i = share.first_node; i < share.last_node; ++i)
        for (const uint32_t e : of_node[i]) {
            const LmEdge& edge = lists.edges[e];
            const bool forwards = edge.a == i;
            const float sign = forwards ? 1.0f : -1.0f;
            const uint32_t row = known_as(share, i),
                           column = known_as(share, forwards ? edge.b : edge.a);
            connections.push_back(
                {{sign * edge.rest[0], sign * edge.rest[1], sign * edge.rest[2], edge.rest[3]},
                 row,
                 column,
                 place(share, row, column) | (forwards ? 0 : kLmUncounted),
                 edge.share});
        }
    share.last_connection = uint32_t(connections.size());
}

void LmPlan::add_items(const LmLists& lists, const std::vector<uint32_t>& given, LmShare& share) {
    share.first_item = uint32_t(items.size());
    for (const uint32_t item : given) {
        const uint32_t which = item & ~kLmUncounted;
        items.push_back(item);
        const auto vectors = lists.items.begin() + std::ptrdiff_t(LmLists::kItemVectors * which);
        item_vectors.insert(item_vectors.end(), vectors, vectors + LmLists::kItemVectors);
        auto& nodes = item_nodes.emplace_back();
        for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k)
            nodes[k] = known_as(share, uint32_t(lists.item_nodes[which][k]));
    }
    share.last_item = uint32_t(items.size());
}

void LmPlan::add_chunk(const LmLists& lists, const LmShare& share, uint32_t chunk) {
    const uint32_t count = share.last_node - share.first_node, from = chunk * kLmChunk;
    std::vector<std::pair<uint32_t, uint16_t>> found;  // target, term
    const uint32_t last_item = std::min(share.first_item + from + kLmChunk, share.last_item);
    for (uint32_t at = share.first_item + from; at < last_item; ++at) {
        const uint32_t item = items[at] & ~kLmUncounted, slot = at - share.first_item - from;
        for (uint32_t k = 0; k < DEFREC_BLEND_NODES; ++k)
            for (uint32_t l = 0; l < DEFREC_BLEND_NODES; ++l) {
                const uint32_t i = item_nodes[at][k], j = item_nodes[at][l];
                if (i >= count || lists.weight(item, k) == 0 || lists.weight(item, l) == 0)
                    continue;
                found.push_back(
                    {i == j ? i : count + place(share, i, j), uint16_t(slot << 4 | k << 2 | l)});
            }
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });

    LmChunk& here = chunks.emplace_back();
    here.first_sum = uint32_t(sums.size());
    here.first_term = uint32_t(terms.size());
    const auto slot_of = [&](uint32_t connection) {  // within the chunk
        return uint16_t(std::min(
            std::max(connection, share.first_connection + from) - share.first_connection - from,
            kLmChunk));
    };
    uint32_t connection = share.first_connection;
    for (uint32_t row = 0; row < count; ++row) {
        const uint32_t first = connection;
        while (connection < share.last_connection && connections[connection].i == row) ++connection;
        sums.push_back({row, 0, 0, slot_of(first), slot_of(connection)});
    }
    const size_t beside = sums.size();
    for (size_t next = 0; next < found.size();) {
        const uint32_t target = found[next].first;
        const auto first = uint16_t(next);
        while (next < found.size() && found[next].first == target)
            terms.push_back(found[next++].second);
        const auto last = uint16_t(next);
        if (target < count) {
            LmSum& own = sums[beside - count + target];
            own.first_term = first;
            own.last_term = last;
        } else {
            sums.push_back({target, first, last, 0, 0});
        }
    }
    deal_out(here.first_sum);
    here.last_sum = uint32_t(sums.size());
    here.last_term = uint32_t(terms.size());
    const auto raise = [](uint32_t& most, uint32_t here_are) { most = std::max(most, here_are); };
    raise(max_items, last_item - std::min(share.first_item + from, last_item));
    raise(max_connections, (slot_of(share.last_connection) + 3u) / 4 * 4);
    raise(max_sums, here.last_sum - here.first_sum);
    raise(max_terms, here.last_term - here.first_term);
}

// Deals out the sums from `first` on: the longest goes to the group that has least to do so far,
// and so on.
void LmPlan::deal_out(size_t first) {
    // In instructions, roughly.
    const auto cost = [](const LmSum& sum) {
        return 40 + 24 * (sum.last_term - sum.first_term) +
               12 * (sum.last_connection - sum.first_connection);
    };
    std::vector<LmSum> given(sums.begin() + std::ptrdiff_t(first), sums.end());
    std::stable_sort(given.begin(), given.end(),
                     [&](const LmSum& a, const LmSum& b) { return cost(a) > cost(b); });
    std::array<std::vector<LmSum>, kLmGroups> of_group;
    std::array<int, kLmGroups> busy{};
    size_t longest = 0;
    for (const LmSum& sum : given) {
        const auto group = size_t(std::min_element(busy.begin(), busy.end()) - busy.begin());
        busy[group] += cost(sum);
        of_group[group].push_back(sum);
        longest = std::max(longest, of_group[group].size());
    }
    sums.resize(first);
    for (size_t turn = 0; turn < longest; ++turn)
        for (const std::vector<LmSum>& those : of_group)
            sums.push_back(turn < those.size() ? those[turn] : LmSum{kLmNoTarget, 0, 0, 0, 0});
}

}  // namespace defrec::cuda
