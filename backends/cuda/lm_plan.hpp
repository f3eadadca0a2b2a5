// How blocks share stage lm's control points: those that evaluate residuals, with what of the
// template enters each one's rows of the system, and those that solve it. Everything is in a fixed
// order, so that sums are the same from run to run.
#pragma once
#include "backends/definition/lm_lists.hpp"

namespace defrec::cuda {

// Items and connections are taken in chunks of this many, each with half of a block's threads.
constexpr uint32_t kLmChunk = 128, kLmThreads = 2 * kLmChunk, kLmWarps = kLmThreads / 32;
// Eight threads add up a block of the matrix, one for each column, half the gradient, and D.
constexpr uint32_t kLmColumns = 8, kLmGroups = kLmThreads / kLmColumns;

// What a block owns: ranges of the lists below. It knows its own control points and those that
// share a residual with them, its own first; indices of control points are among these unless said
// otherwise. A place is a block of the matrix beside the diagonal.
struct LmShare {
    uint32_t first_node, last_node;  // its own, of all
    uint32_t first_known, last_known;
    uint32_t first_place, last_place;
    uint32_t first_item, last_item;
    uint32_t first_connection, last_connection;
    uint32_t first_chunk, chunks;
};

// Among the control points that its block knows.
struct LmPlace {
    uint32_t row, column;
};

constexpr uint32_t kLmUncounted =
    1u << 31;  // of an item or a connection's place: the residual is another's to count

// An edge as one of its two control points sees it: j from i.
struct alignas(16) LmConnection {
    Vector4 rest;  // direction from i to j, and length
    uint32_t i, j;
    uint32_t place;  // among its block's
    float share;     // of the data's weight that S is
};

constexpr uint32_t kLmNoTarget = ~0u;

// The terms of a chunk that enter one block of the matrix: the control point's own where target <
// rows, else place target - rows. Ranges are among the chunk's. A chunk's sums are dealt out to
// kLmGroups of threads in turn; those that have fewer than others end with one of kLmNoTarget.
struct LmSum {
    uint32_t target;
    uint16_t first_term, last_term;
    uint16_t first_connection, last_connection;
};

struct LmChunk {
    uint32_t first_sum, last_sum, first_term, last_term;
};

struct LmPlan {
    uint32_t rows = 1;        // most control points of a block
    uint32_t max_known = 0;   // likewise
    uint32_t max_places = 0;  // of a block
    // The most in a chunk; connections in multiples of four.
    uint32_t max_items = 0, max_connections = 0, max_sums = 0, max_terms = 0;
    std::vector<LmShare> shares;
    std::vector<uint32_t> known;  // of all control points
    std::vector<LmPlace> places;
    std::vector<uint32_t> row_places;  // of each control point: its first place, and the end
    std::vector<uint32_t> items;       // of the template
    std::vector<std::array<uint32_t, DEFREC_BLEND_NODES>> item_nodes;
    std::vector<Vector4> item_vectors;  // LmLists::kItemVectors each
    std::vector<LmConnection> connections;
    std::vector<LmChunk> chunks;
    std::vector<LmSum> sums;
    std::vector<uint16_t> terms;  // slot in the chunk << 4 | k << 2 | l, of the item's control
                                  // points in row and column

    // For at most that many blocks.
    LmPlan(const LmTemplate& surface, const LmLists& lists, uint32_t max_blocks);

  private:
    using Edges = std::vector<std::vector<uint32_t>>;
    void add_rows(const BlockPattern& pattern, LmShare& share);
    void add_connections(const LmLists& lists, const Edges& of_node, LmShare& share);
    void add_items(const LmLists& lists, const std::vector<uint32_t>& given, LmShare& share);
    void add_chunk(const LmLists& lists, const LmShare& share, uint32_t chunk);
    void deal_out(size_t first);
    uint32_t known_as(const LmShare& share, uint32_t node) const;
    uint32_t place(const LmShare& share, uint32_t row, uint32_t column) const;
    std::vector<std::vector<uint32_t>> items_of_blocks(const LmLists& lists) const;
};

// What a block of the solver owns, likewise.
struct LmRowShare {
    uint32_t first_node, last_node;
    uint32_t first_known, last_known;
    uint32_t first_place, last_place;
};

// Places are those of LmPlan, in their order.
struct LmRowPlan {
    uint32_t rows = 1;  // control points of each block, but for the last one
    uint32_t max_known = 0, max_places = 0;
    std::vector<LmRowShare> shares;
    std::vector<uint32_t> known;
    std::vector<LmPlace> places;

    // For at most that many blocks.
    LmRowPlan(const BlockPattern& pattern, uint32_t nodes, uint32_t max_blocks);
};

}  // namespace defrec::cuda
