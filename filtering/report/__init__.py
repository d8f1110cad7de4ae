"""The page that shows every video beside its weight."""

from filtering.report.layout import Mark
from filtering.report.page import DemoView, ReportSection, Segment, render_report

__all__ = ["DemoView", "Mark", "ReportSection", "Segment", "render_report"]
