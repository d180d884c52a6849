"""Style sheet of the reports, for light and dark screens and for paper."""

STYLE = """
:root {
  color-scheme: light dark;
  --ground: #ffffff; --panel: #f5f6f8; --ink: #1b1f24; --quiet: #5b6470; --rule: #d9dde3;
  --good: #1a7f37; --bad: #c0281c; --part: #9a6700; --open: #6639ba;
  --truth: #8a94a3; --printed: #0b62c4; --terminal: #f0f2f5;
}
@media (prefers-color-scheme: dark) {
  :root {
    --ground: #14171b; --panel: #1d2126; --ink: #e4e7eb; --quiet: #9aa4b1; --rule: #343a42;
    --good: #4ac26b; --bad: #ff7b72; --part: #d9a441; --open: #b48cff;
    --truth: #7c8795; --printed: #6cb0ff; --terminal: #0d1013;
  }
}
* { box-sizing: border-box; }
body { background: var(--ground); color: var(--ink); font: 16px/1.5 system-ui, sans-serif;
  max-width: 60rem; margin: 0 auto; padding: 1.5rem 1rem 4rem; overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 0 0 .25rem; }
h2 { font-size: 1.2rem; margin: 2.2rem 0 .5rem; padding-bottom: .25rem;
  border-bottom: 1px solid var(--rule); }
h3 { font-size: 1rem; margin: 1.4rem 0 .4rem; }
a { color: var(--printed); }
p { margin: .4rem 0; }
.quiet { color: var(--quiet); font-size: .9rem; }
.points { font-size: 1.5rem; font-weight: 600; margin: .8rem 0 .2rem; }
.notice { background: var(--panel); border-left: 4px solid var(--open); padding: .6rem .9rem;
  margin: 1rem 0; }
table { border-collapse: collapse; width: 100%; font-size: .95rem; }
th { text-align: left; font-weight: 600; color: var(--quiet); font-size: .85rem; }
th, td { padding: .35rem .6rem .35rem 0; border-bottom: 1px solid var(--rule); vertical-align: top; }
th:last-child, td:last-child { padding-right: 0; }
td.number, th.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
td.who, td.what { min-width: 9rem; }
.scroll { overflow-x: auto; }
.check { display: grid; grid-template-columns: 1.4rem 1fr auto; gap: .1rem .5rem; padding: .45rem 0;
  border-bottom: 1px solid var(--rule); }
.check dl { grid-column: 2 / 4; margin: .2rem 0 .1rem; display: grid; grid-template-columns: 5.5rem 1fr;
  gap: .15rem .5rem; font-size: .92rem; }
.check dt { color: var(--quiet); }
.check dd { margin: 0; white-space: pre-wrap; }
.worth { color: var(--quiet); white-space: nowrap; font-variant-numeric: tabular-nums; }
.passed { color: var(--good); } .failed { color: var(--bad); } .partial { color: var(--part); }
.unjudged { color: var(--open); }
.mark { font-weight: 700; }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(22rem, 1fr)); gap: .2rem 1rem; }
figure { margin: .5rem 0; }
figcaption { font-size: .9rem; color: var(--quiet); }
svg.plot { width: 100%; max-width: 40rem; height: auto; display: block; }
svg.share { width: 7rem; height: .55rem; }
svg text { font: 11px system-ui, sans-serif; fill: var(--quiet); }
svg .warn { fill: var(--bad); }
svg .grid { stroke: var(--rule); stroke-width: 1; }
svg .axis { stroke: var(--quiet); stroke-width: 1; }
svg .truth { stroke: var(--truth); stroke-width: 2; fill: none; }
svg .printed { fill: var(--printed); }
svg .beyond { fill: var(--bad); }
svg .none { stroke: var(--bad); stroke-width: 1.6; fill: none; }
svg .bar { fill: var(--printed); }
svg .bar-ground { fill: var(--rule); }
pre { background: var(--terminal); border: 1px solid var(--rule); border-radius: 4px; padding: .7rem .8rem;
  font: .82rem/1.4 ui-monospace, monospace; white-space: pre-wrap; overflow-wrap: anywhere; margin: .4rem 0; }
details { margin: .5rem 0; }
summary { cursor: pointer; color: var(--printed); }
.cause { border-left: 4px solid var(--part); background: var(--panel); padding: .5rem .9rem;
  margin: .6rem 0; }
.cause.fatal { border-color: var(--bad); }
.cause p:first-child { font-weight: 600; }
@media (max-width: 32rem) { .check dl, .plots { grid-template-columns: 1fr; } }
@media print { body { max-width: none; } .check, figure, .cause { break-inside: avoid; } }
"""
