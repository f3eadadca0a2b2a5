// Pixels of images and masks that are halved (docs/stages/align.md, section 2, and orb.md, section
// 1), from the whole ones.
int mean_of(int a, int b, int c, int d) { return (a + b + c + d + 2) >> 2; }
int least_of(int a, int b, int c, int d) { return min(min(a, b), min(c, d)); }

// Defines name(x, y), a pixel of an image half as large as below's, made of four of these.
#define HALVED(name, below, make)                                                          \
    int name(int x, int y) {                                                               \
        return make(below(2 * x, 2 * y), below(2 * x + 1, 2 * y), below(2 * x, 2 * y + 1), \
                    below(2 * x + 1, 2 * y + 1));                                          \
    }
