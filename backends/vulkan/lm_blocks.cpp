// See lm_blocks.hpp.
#include "backends/vulkan/lm_blocks.hpp"

namespace defrec::vulkan {
namespace {

// Terms (block, what) by block, each block's in the order given.
template <class What, class SetRange>
std::vector<What> by_block(const std::vector<std::pair<uint32_t, What>>& terms, size_t blocks,
                           SetRange&& set_range) {
    std::vector<uint32_t> starts(blocks + 1, 0);
    std::vector<What> sorted(terms.size());
    for (const auto& term : terms) ++starts[term.first + 1];
    for (size_t b = 0; b < blocks; ++b) starts[b + 1] += starts[b];
    for (size_t b = 0; b < blocks; ++b) set_range(b, starts[b], starts[b + 1]);
    for (const auto& [block, what] : terms) sorted[starts[block]++] = what;
    return sorted;
}

}  // namespace

LmBlocks::LmBlocks(const defrec_lm_params& params, const LmTemplate& surface)
    : LmLists(params, surface) {
    const BlockPattern& pattern = surface.pattern;
    std::vector<uint32_t> block_at(
        pattern.blocks());  // of a place in the matrix, where it is in `blocks`
    const auto add = [&](uint32_t row, uint32_t column) {
        const auto place = uint32_t(pattern.find(int32_t(row), int32_t(column)));
        block_at[place] = uint32_t(blocks.size());
        blocks.push_back({0, 0, 0, 0, row, column, place,
                          uint32_t(pattern.find(int32_t(column), int32_t(row)))});
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
    std::stable_sort(blocks.begin() + std::ptrdiff_t(pattern.rows()), blocks.end(),
                     [](const LmBlock& a, const LmBlock& b) {
                         return a.last_item - a.first_item > b.last_item - b.first_item;
                     });
    for (const LmBlock& b : blocks)
        longest =
            std::max<size_t>(longest, b.last_item - b.first_item + b.last_edge - b.first_edge);
}

void LmBlocks::add_item_terms(const BlockPattern& pattern, const std::vector<uint32_t>& block_at) {
    std::vector<std::pair<uint32_t, uint32_t>> terms;
    for (size_t item = 0; item < item_nodes.size(); ++item)
        for (uint32_t k = 0; k < DEFREC_BLEND_NODES; ++k)
            for (uint32_t l = 0; l < DEFREC_BLEND_NODES; ++l) {
                const int32_t row = item_nodes[item][k], column = item_nodes[item][l];
                if (row > column || weight(item, k) == 0 || weight(item, l) == 0) continue;
                terms.push_back(
                    {block_at[pattern.find(row, column)], uint32_t(item) << 4 | k << 2 | l});
            }
    item_terms = by_block(terms, blocks.size(), [this](size_t b, uint32_t first, uint32_t last) {
        blocks[b].first_item = first;
        blocks[b].last_item = last;
    });
}

void LmBlocks::add_edge_terms(const BlockPattern& pattern, const std::vector<uint32_t>& block_at) {
    std::vector<std::pair<uint32_t, LmEdgeTerm>> terms;
    for (uint32_t i = 0; i < edges.size(); ++i) {
        const auto a = uint32_t(edges[i].a), b = uint32_t(edges[i].b);
        terms.push_back({a, {i << 1, b}});
        terms.push_back({b, {i << 1 | 1, a}});
        terms.push_back({block_at[pattern.find(int32_t(a), int32_t(b))], {i << 1, b}});
    }
    edge_terms = by_block(terms, blocks.size(), [this](size_t b, uint32_t first, uint32_t last) {
        blocks[b].first_edge = first;
        blocks[b].last_edge = last;
    });
}

}  // namespace defrec::vulkan
