// The blocks of the system, kSplit invocations of a work group to each, and what of the template
// enters them. Needs lm.glsl.
layout(local_size_x = 64) in;
layout(constant_id = 0) const uint kSplit = 8;  // divides kBlockGroup

// Parts of a number of item_terms: the item, and which of its control points are the row's and the
// column's.
uint term_item(uint term) { return term >> 4; }
uint term_row(uint term) { return (term >> 2) & 3; }
uint term_column(uint term) { return term & 3; }

uint term_edge(LmEdgeTerm term) { return term.edge >> 1; }
bool term_second(LmEdgeTerm term) { return (term.edge & 1) != 0; }
