// Stage stereo, section 6: the field of samples and its coarser ones, one after the other in one
// buffer. Without any disparity all of them stay as they are: the mean of DEFREC_DISPARITY_NONE is
// itself.

struct Level {
    int width, height, offset;
};

Level finest_level() { return Level(push.half_samples_x, push.half_samples_y, 0); }
Level coarser_than(Level level) {
    return Level((level.width + 1) / 2, (level.height + 1) / 2,
                 level.offset + level.width * level.height);
}
bool is_coarsest(Level level) { return level.width == 1 && level.height == 1; }

// The mean of four pixels, of which some may be missing. Disparities are not negative.
int mean_of(ivec4 four) {
    int sum = 0, n = 0;
    [[unroll]] for (int k = 0; k < 4; ++k) {
        sum += four[k] == kNoDisparity ? 0 : four[k];
        n += four[k] == kNoDisparity ? 0 : 1;
    }
    return n == 0 ? kNoDisparity : (2 * sum + n) / (2 * n);
}

// A hole from the pixel of the coarser field that it lies in and that one's nearest neighbours.
int filled(int near, int beside, int above, int across) {
    return (9 * near + 3 * beside + 3 * above + across + 8) >> 4;
}
