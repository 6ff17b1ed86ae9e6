"""The same experiment many times: every combination of some options, with several seeds, on one computer or many.

What is typed becomes a plan (`plan`). A runner (`runner`, `ray_runner`) carries out its runs, calling the same
function for each (`attempt`). They are kept one by one as they finish (`store`), and end as tables, a picture and
a report.
"""
