/*
 * accuracy.h - every tolerance of the renderer that trades time for truth.
 *
 * Promise for one object: |pixel error| <= max(eps * its peak pixel, floor),
 * also for the pixels its stamp leaves out.  The shares below divide that
 * tolerance among the approximations; their bounds are rigorous or measured
 * (tests/unit/test_render.c compares with stamps four times larger).
 */
#ifndef PIXSHEAR_ACCURACY_H
#define PIXSHEAR_ACCURACY_H

struct accuracy {
    double eps;        /* error over the object's peak pixel; 1e-12 .. 0.5 */
    double floor;      /* error allowed whatever the peak, electrons; >= 0 */
    double wing;       /* share for PSF wings outside the stamp and folded back; larger: smaller stamps */
    double edge;       /* share for the object's own light outside the stamp (bound) */
    double band;       /* share for frequencies left out (bound); larger: fewer frequencies */
    double shear;      /* share for orders cut off in coefficient-space shear; larger: fewer orders */
    double g_matrix;   /* largest |g| sheared in coefficient space when there is a PSF; only speed */
    int order_max;     /* highest order of sheared coefficients; beyond, the shear is evaluated */
    int side_max;      /* largest stamp, pixels: larger objects are summed (broad.h), wings beyond are cut and counted */
};

/* As measured: 1e-5 of the peak, no floor. */
#define ACCURACY_DEFAULT {.eps = 1e-5, .floor = 0, .wing = 0.88, .edge = 0.4, .band = 0.5, .shear = 0.3, \
                          .g_matrix = 0.2, .order_max = 60, .side_max = 2048}

#endif
