// Sums over the square windows of a tile of 32 x 32 pixels: along rows into shared memory, then each invocation runs down 8 pixels of
// a column.
layout(local_size_x = 32, local_size_y = 4) in;

const int kTile = 32, kInvocations = 128, kRun = 8;
const int kMostSide = kTile + 2 * 8;  // with windows of the largest radius

int cell(ivec2 at);  // the summand of a pixel; 0 outside the image

shared int cells[kMostSide][kMostSide + 1];
shared int row_sums[kMostSide][kTile + 1];

void sum_rows(int radius) {
    const ivec2 first = ivec2(gl_WorkGroupID.xy) * kTile - radius;
    const int side = kTile + 2 * radius, me = int(gl_LocalInvocationIndex);
    for (int i = me; i < side * side; i += kInvocations) cells[i / side][i % side] = cell(first + ivec2(i % side, i / side));
    barrier();
    for (int i = me; i < side * (kTile / kRun); i += kInvocations) {
        const int row = i % side, column = i / side * kRun;
        int sum = 0;
        for (int u = 0; u < 2 * radius; ++u) sum += cells[row][column + u];
        for (int u = 0; u < kRun; ++u) {
            sum += cells[row][column + u + 2 * radius];
            row_sums[row][column + u] = sum;
            sum -= cells[row][column + u];
        }
    }
    barrier();
}

// The invocation's first pixel; the others lie below it.
ivec2 first_of_run() { return ivec2(gl_WorkGroupID.xy) * kTile + ivec2(gl_LocalInvocationID.x, kRun * gl_LocalInvocationID.y); }

// The rows above the last of the first pixel's window.
int start_of_run(int radius) {
    const int x = int(gl_LocalInvocationID.x), y = kRun * int(gl_LocalInvocationID.y);
    int sum = 0;
    for (int v = 0; v < 2 * radius; ++v) sum += row_sums[y + v][x];
    return sum;
}

// The window of the run's pixel j, and on to the next.
int next_of_run(inout int sum, int j, int radius) {
    const int x = int(gl_LocalInvocationID.x), y = kRun * int(gl_LocalInvocationID.y) + j;
    const int whole = sum + row_sums[y + 2 * radius][x];
    sum = whole - row_sums[y][x];
    return whole;
}
