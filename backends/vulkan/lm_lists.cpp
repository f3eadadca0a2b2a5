// See lm_lists.hpp.
#include "backends/vulkan/lm_lists.hpp"

namespace defrec::vulkan {
namespace {

Vector4 vector(Vec3<double> v, double w) { return {float(v.x), float(v.y), float(v.z), float(w)}; }

// Terms (block, what) by block, each block's in the order given.
template <class SetRange>
std::vector<uint32_t> by_block(const std::vector<std::pair<uint32_t, uint32_t>>& terms, size_t blocks, SetRange&& set_range) {
    std::vector<uint32_t> starts(blocks + 1, 0), sorted(terms.size());
    for (const auto& term : terms) ++starts[term.first + 1];
    for (size_t b = 0; b < blocks; ++b) starts[b + 1] += starts[b];
    for (size_t b = 0; b < blocks; ++b) set_range(b, starts[b], starts[b + 1]);
    for (const auto& [block, what] : terms) sorted[starts[block]++] = what;
    return sorted;
}

}  // namespace

LmLists::LmLists(const defrec_lm_params& params, const LmTemplate& surface) {
    for (const Vec3<double>& node : surface.nodes) rest.push_back(vector(node, 0));
    add_items<defrec_surface_point>(surface, surface.points, [](const defrec_surface_point& p) { return &p.normal[0]; });
    add_items<defrec_surface_point>(surface, surface.landmarks, nullptr);
    add_items<defrec_patch>(surface, surface.patches, nullptr);
    const double share = kArapShare * double(params.arap_weight) / surface.mean_degree;
    for (size_t i = 0; i < surface.edges.size(); ++i) {
        const defrec_edge& edge = surface.edges[i];
        edges.push_back({vector(surface.rest_direction[i], surface.rest_length[i]), uint32_t(edge.a), uint32_t(edge.b),
                         float(share * double(edge.weight))});
    }
    add_blocks(surface.pattern);
}

template <class Item>
void LmLists::add_items(const LmTemplate& surface, const HostVector<Item>& given, const float* (*normal)(const Item&)) {
    for (const Item& item : given) {
        const Vec3<double> position = load3<double>(item.position);
        items.push_back(vector(position, 0));
        items.push_back(normal != nullptr ? vector(load3<double>(normal(item)), 0) : Vector4{});
        auto& nodes = item_nodes.emplace_back();
        for (size_t k = 0; k < DEFREC_SKIN_NODES; ++k) {
            nodes[k] = item.node[k];
            items.push_back(vector(position - surface.nodes[size_t(item.node[k])], double(item.weight[k])));
        }
    }
}

void LmLists::add_blocks(const BlockPattern& pattern) {
    std::vector<uint32_t> block_at(pattern.blocks());  // of a place in the matrix, where it is in `blocks`
    const auto add = [&](uint32_t row, uint32_t column) {
        const auto place = uint32_t(pattern.find(int32_t(row), int32_t(column)));
        block_at[place] = uint32_t(blocks.size());
        blocks.push_back({0, 0, 0, 0, row, column, place, uint32_t(pattern.find(int32_t(column), int32_t(row)))});
    };
    for (uint32_t i = 0; i < pattern.rows(); ++i) add(i, i);
    for (uint32_t i = 0; i < pattern.rows(); ++i) {
        row_starts.push_back(uint32_t(pattern.row_start(i)));
        for (size_t place = pattern.row_start(i); place < pattern.row_start(i + 1); ++place) {
            columns.push_back(uint32_t(pattern.column(place)));
            if (columns.back() > i) add(i, columns.back());
        }
        longest = std::max(longest, pattern.row_start(i + 1) - pattern.row_start(i));
    }
    row_starts.push_back(uint32_t(pattern.blocks()));
    add_item_terms(pattern, block_at);
    add_edge_terms(pattern, block_at);
    // Neighbouring invocations then have equally much to do.
    std::stable_sort(blocks.begin() + std::ptrdiff_t(pattern.rows()), blocks.end(), [](const LmBlock& a, const LmBlock& b) {
        return a.last_item - a.first_item > b.last_item - b.first_item;
    });
    for (const LmBlock& b : blocks)
        longest = std::max<size_t>(longest, b.last_item - b.first_item + b.last_edge - b.first_edge);
}

void LmLists::add_item_terms(const BlockPattern& pattern, const std::vector<uint32_t>& block_at) {
    std::vector<std::pair<uint32_t, uint32_t>> terms;
    for (size_t item = 0; item < item_nodes.size(); ++item)
        for (uint32_t k = 0; k < DEFREC_SKIN_NODES; ++k)
            for (uint32_t l = 0; l < DEFREC_SKIN_NODES; ++l) {
                const int32_t row = item_nodes[item][k], column = item_nodes[item][l];
                const Vector4* arms = &items[items.size() / item_nodes.size() * item + 2];
                if (row > column || arms[k][3] == 0 || arms[l][3] == 0) continue;
                terms.push_back({block_at[pattern.find(row, column)], uint32_t(item) << 4 | k << 2 | l});
            }
    item_terms = by_block(terms, blocks.size(), [this](size_t b, uint32_t first, uint32_t last) {
        blocks[b].first_item = first;
        blocks[b].last_item = last;
    });
}

void LmLists::add_edge_terms(const BlockPattern& pattern, const std::vector<uint32_t>& block_at) {
    std::vector<std::pair<uint32_t, uint32_t>> terms;
    for (uint32_t i = 0; i < edges.size(); ++i) {
        terms.push_back({edges[i].a, i << 1});
        terms.push_back({edges[i].b, i << 1 | 1});
        terms.push_back({block_at[pattern.find(int32_t(edges[i].a), int32_t(edges[i].b))], i << 1});
    }
    edge_terms = by_block(terms, blocks.size(), [this](size_t b, uint32_t first, uint32_t last) {
        blocks[b].first_edge = first;
        blocks[b].last_edge = last;
    });
}

}  // namespace defrec::vulkan
