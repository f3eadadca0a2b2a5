// How the blocks of the solver share stage lm's control points, and what of the template enters each one's rows of the system.
// Everything is in a fixed order, so that sums are the same from run to run.
#pragma once
#include "backends/shared/lm_lists.hpp"

namespace defrec::cuda {

// Items and connections are taken in chunks of this many, each with half of a block's threads.
constexpr uint32_t kLmChunk = 128, kLmThreads = 2 * kLmChunk;

// What a block owns: ranges of the lists below. A place is a block of the matrix beside the diagonal.
struct LmShare {
    uint32_t first_node, last_node;
    uint32_t first_place, last_place;
    uint32_t first_item, last_item;
    uint32_t first_connection, last_connection;
    uint32_t first_chunk, chunks;
};

// Where in the matrix a place lies: the row among its block's, and the column.
struct LmPlace {
    uint32_t row, column;
};

// An edge as one of its two control points sees it: j from i.
struct alignas(16) LmConnection {
    Vector4 rest;  // direction from i to j, and length
    uint32_t i, j;
    uint32_t place;  // among its block's
    float share;     // of the data's weight that S is
};

// The terms of a chunk that enter one block of the matrix: the control point's own where target < rows, else place target - rows.
struct LmSum {
    uint32_t first_term, last_term;              // of terms
    uint32_t target;
    uint16_t first_connection, last_connection;  // among the chunk's
};

struct LmPlan {
    static constexpr uint32_t kUncounted = 1u << 31;  // of an item: its residual is another block's to count

    uint32_t rows;  // most control points of a block
    std::vector<LmShare> shares;
    std::vector<LmPlace> places;
    std::vector<uint32_t> row_places;  // of each control point: its first place, and the end
    std::vector<uint32_t> items;
    std::vector<LmConnection> connections;
    std::vector<uint32_t> chunks;  // first sums, and the end
    std::vector<LmSum> sums;
    std::vector<uint32_t> terms;  // slot in the chunk << 4 | k << 2 | l, of the item's control points in row and column
    uint32_t most_places = 0;     // of a block

    // For at most that many blocks.
    LmPlan(const LmTemplate& surface, const LmLists& lists, uint32_t most_blocks);

  private:
    void add_rows(const BlockPattern& pattern);
    void add_connections(const LmLists& lists);
    void add_items(const LmLists& lists);
    void add_sums(const LmLists& lists);
    void add_chunk(const LmLists& lists, const LmShare& share, uint32_t chunk);
    uint32_t place(uint32_t row, uint32_t column) const;
    uint32_t owner(int32_t node) const { return uint32_t(node) / rows; }
};

}  // namespace defrec::cuda
