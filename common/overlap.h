/*
 * overlap.h - exact area of a polygon in unit cells, by Green's theorem.
 *
 * Cell (i, j) covers [i, i+1) x [j, j+1).  The area in a cell is the integral
 * of min(max(x - i, 0), 1) dy along the border, row by row.  No clipping, no
 * case distinction by shape.
 */
#ifndef PIXSHEAR_OVERLAP_H
#define PIXSHEAR_OVERLAP_H

/* Area of the quadrilateral, positive when its corners run counter-clockwise. */
double overlap_area(const double x[4], const double y[4]);

/*
 * Signed area of the quadrilateral in cells (first + i, row), 0 <= i < n, into
 * area[0..n-1]; area has n + 2 elements.  The sign is that of overlap_area.
 * Rounding error about 2e-16 per edge for coordinates of order 1, and 2e-16
 * times the largest coordinate.
 */
void overlap_row(const double x[4], const double y[4], long row, long first, long n, double *area);

/* Many small quadrilaterals at a time, one a lane. */
enum { OVERLAP_LANES = 16, OVERLAP_WINDOW = 8 };

/* Edges from their lower (ax, ay) to their upper end (bx, by), in cells of the lane's window. */
struct overlap_edges {
    double ax[4][OVERLAP_LANES], ay[4][OVERLAP_LANES], bx[4][OVERLAP_LANES], by[4][OVERLAP_LANES];
    double x_per_y[4][OVERLAP_LANES];    /* 0 for a level edge */
    double rise[4][OVERLAP_LANES];       /* 1 where the border runs up, -1 where down, 0 level; times a factor */
    double step[4][OVERLAP_LANES];       /* rise |dy/dx| / 2; 0 for an upright edge */
};

/* The edges of the quadrilaterals x[corner][lane], y[corner][lane]; factor multiplies their areas. */
void overlap_edges_make(struct overlap_edges *e, const double x[4][OVERLAP_LANES], const double y[4][OVERLAP_LANES],
                        const double factor[OVERLAP_LANES]);

/*
 * Areas in the cells of windows of nx x ny cells (2..OVERLAP_WINDOW per side)
 * that hold their quadrilaterals: area[ny][nx][OVERLAP_LANES].  Areas below
 * `least` become 0.  A lane's result depends on its own edges alone.
 */
void overlap_lanes(const struct overlap_edges *e, int nx, int ny, double least, double *area);

#endif
