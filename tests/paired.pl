#!/usr/bin/perl
# paired.pl - two measurements of the same quantities, "A B" a line (errors against the truth): is B worse than A?
# Prints N, the medians of A and B, their 1.4826 median deviations, then B's |median| less A's and B's deviation over A's, each
# followed by its standard error from 400 bootstrap resamples of the lines (always the same ones).
use strict; use warnings;
my @pair = map { [split] } <STDIN>;
my $seed = 4711;
sub middle { my @v = sort { $a <=> $b } @_; my $n = @v; return $n % 2 ? $v[$n / 2] : ($v[$n / 2 - 1] + $v[$n / 2]) / 2 }
sub bias_scatter { my @v = @_; my $m = middle(@v); return ($m, 1.4826 * middle(map { abs($_ - $m) } @v)) }
sub compare { my ($ma, $sa) = bias_scatter(map { $_->[0] } @_); my ($mb, $sb) = bias_scatter(map { $_->[1] } @_);
    return ($ma, $mb, $sa, $sb, abs($mb) - abs($ma), $sa > 0 ? $sb / $sa : 'none') }
sub rms { my ($s, $q) = (0, 0); $s += $_ for @_; $s /= @_; $q += ($_ - $s) ** 2 for @_; return sqrt($q / (@_ - 1)) }
die "paired.pl: fewer than 10 pairs\n" if @pair < 10;
my @all = compare(@pair);
my (@d, @r);
for (1 .. 400) {
    my @again = compare(map { $seed = ($seed * 16807) % 2147483647; $pair[$seed % @pair] } @pair);
    push @d, $again[4]; push @r, $again[5];
}
printf "%d %.5f %.5f %.5f %.5f %.5f %.5f %.5f %.5f\n", scalar(@pair), @all[0 .. 4], rms(@d), $all[5], rms(@r);
