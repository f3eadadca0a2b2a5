// Stage stereo, section 6: smoothing along a line. A missing neighbour differs from every disparity
// by more than the range, and a missing sample from all but missing ones, so that it stays missing.

int near_sum(int difference, int range, inout int n) {
    const bool near = abs(difference) <= range;
    n += near ? 1 : 0;
    return near ? difference : 0;
}

// n neighbours, itself included, sum the differences to them.
int moved(int centre, int sum, int n) {
    const int reciprocal = n <= 2   ? kReciprocal[2]
                           : n == 3 ? kReciprocal[3]
                           : n == 4 ? kReciprocal[4]
                                    : kReciprocal[5];
    return centre + ((sum * reciprocal + (1 << 14)) >> 15);
}

// With radius 1.
int smoothed(int before, int centre, int after, int range) {
    int n = 1, sum = near_sum(before - centre, range, n);
    sum += near_sum(after - centre, range, n);
    return moved(centre, sum, n);
}
