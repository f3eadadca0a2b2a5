// What the shaders of stage lm read of the template: its items, and for each block of the system what enters it, in a fixed order.
#pragma once
#include <array>
#include <vector>

#include "backends/shared/lm_inputs.hpp"

namespace defrec::vulkan {

using Vector4 = std::array<float, 4>;

// As lm.glsl, lm_blocks.glsl and lm_edges.comp lay them out.
struct LmBlock {
    uint32_t first_item, last_item, first_edge, last_edge;
    uint32_t row, column;
    uint32_t place, transposed;
};
struct LmEdge {
    Vector4 rest;
    uint32_t a, b;
    float share;
    uint32_t unused = 0;
};

struct LmLists {
    std::vector<Vector4> rest;   // control points
    std::vector<Vector4> items;  // points, landmarks, patches; kItemVectors each
    std::vector<std::array<int32_t, DEFREC_SKIN_NODES>> item_nodes;
    std::vector<LmEdge> edges;
    std::vector<LmBlock> blocks;
    std::vector<uint32_t> item_terms, edge_terms;
    std::vector<uint32_t> row_starts, columns;  // of the matrix
    size_t longest = 0;                         // terms of a block, blocks of a row

    LmLists(const defrec_lm_params& params, const LmTemplate& surface);

  private:
    template <class Item>
    void add_items(const LmTemplate& surface, const HostVector<Item>& given, const float* (*normal)(const Item&));
    void add_blocks(const BlockPattern& pattern);
    void add_item_terms(const BlockPattern& pattern, const std::vector<uint32_t>& block_at);
    void add_edge_terms(const BlockPattern& pattern, const std::vector<uint32_t>& block_at);
};

}  // namespace defrec::vulkan
