// What the shaders of stage lm read of the template: its items, and for each block of the system
// what enters it, in a fixed order.
#pragma once
#include "backends/definition/lm_lists.hpp"
#include "backends/vulkan/shaders/lm_structs.h"

namespace defrec::vulkan {

struct LmBlocks : LmLists {
    std::vector<LmBlock> blocks;
    std::vector<uint32_t> item_terms;
    std::vector<LmEdgeTerm> edge_terms;
    std::vector<uint32_t> row_starts, columns;  // of the matrix
    size_t longest = 0;                         // terms of a block, blocks of a row

    LmBlocks(const defrec_lm_params& params, const LmTemplate& surface);

  private:
    void add_item_terms(const BlockPattern& pattern, const std::vector<uint32_t>& block_at);
    void add_edge_terms(const BlockPattern& pattern, const std::vector<uint32_t>& block_at);
};

}  // namespace defrec::vulkan
