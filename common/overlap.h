/*
 * overlap.h - exact area of a polygon in unit cells, by Green's theorem.
 *
 * Cell (i, j) covers [i, i+1) x [j, j+1).  Every edge adds, to each cell it
 * passes, the area to its right inside the cell; the running sum along a row
 * is the covered area.  No clipping, no case distinction by shape.
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

#endif
